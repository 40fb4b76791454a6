//! Logarithmic axes, and text as charts need it.

/// A logarithmic axis between two places of the picture.
pub struct LogAxis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl LogAxis {
    /// Holds all values, and more than one of the ticks.
    #[must_use]
    pub fn around(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Self {
        let low = values.clone().fold(f64::INFINITY, f64::min) / 1.15;
        let high = values.fold(0.0, f64::max) * 1.15;
        let grow = (4.0 * low / high).max(1.0).sqrt();
        Self { low: low / grow, high: high * grow, from, to }
    }

    /// Where a value lies.
    #[must_use]
    pub fn at(&self, value: f64) -> f64 {
        self.from + (self.to - self.from) * (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// 1, 2 and 5 times powers of ten; powers of ten alone where those would be too many.
    #[must_use]
    pub fn ticks(&self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let all = |steps: &'static [f64]| -> Vec<f64> {
            let values =
                decades.clone().flat_map(|decade| steps.iter().map(move |step| step * 10_f64.powi(decade)));
            values.filter(|value| (self.low..=self.high).contains(value)).collect()
        };
        let fine = all(&[1.0, 2.0, 5.0]);
        if fine.len() <= 8 { fine } else { all(&[1.0]) }
    }
}

/// A number above zero with as few digits as it has.
#[must_use]
pub fn plain(value: f64) -> String {
    let decimals = (1 - value.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Text for XML and HTML.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML knows no other control characters, escaped or not.
            c if c.is_control() && !matches!(c, '\t' | '\n' | '\r') => {}
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_no_digits_too_many() {
        assert_eq!([0.05, 0.2, 1.0, 20.0, 500.0].map(plain), ["0.05", "0.2", "1", "20", "500"]);
    }

    #[test]
    fn equal_ratios_are_equal_lengths() {
        let axis = LogAxis::around([0.1, 10.0].into_iter(), 0.0, 100.0);
        assert!((axis.at(1.0) - 50.0).abs() < 1e-9 && axis.at(0.1) > 0.0 && axis.at(10.0) < 100.0);
        assert_eq!(axis.ticks(), [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]);
    }
}
