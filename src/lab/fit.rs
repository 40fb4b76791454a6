//! What is read off a curve: its slope, and when it reaches an error.

use super::Point;

/// The exponent b of error ∝ time^b: the slope of the least-squares line through the logarithms. `None` of fewer than
/// two different times.
#[must_use]
pub fn slope(points: &[Point]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.iter().map(|p| (p.cpu.ln(), p.error.ln())).collect();
    let count = logs.len() as f64;
    let (x, y) =
        (logs.iter().map(|l| l.0).sum::<f64>() / count, logs.iter().map(|l| l.1).sum::<f64>() / count);
    let square: f64 = logs.iter().map(|l| (l.0 - x).powi(2)).sum();
    let product: f64 = logs.iter().map(|l| (l.0 - x) * (l.1 - y)).sum();
    (square > 0.0).then(|| product / square)
}

/// The later half of the points, at least three: the start holds what is done once, and says nothing of the rate.
#[must_use]
pub fn tail(points: &[Point]) -> &[Point] {
    let kept = points.len().div_ceil(2).max(3).min(points.len());
    &points[points.len() - kept..]
}

/// CPU seconds to an error, on straight lines between the points of the log-log chart. Already below it at the first
/// point: that point's time, which is an upper bound. `None` if it is not reached.
#[must_use]
pub fn time_to_reach(points: &[Point], error: f64) -> Option<f64> {
    let index = points.iter().position(|p| p.error <= error)?;
    let after = points[index];
    let Some(before) = index.checked_sub(1).map(|i| points[i]) else { return Some(after.cpu) };
    let part = (before.error / error).ln() / (before.error / after.error).ln();
    Some((before.cpu.ln() + part * (after.cpu / before.cpu).ln()).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(exponent: f64, times: &[f64]) -> Vec<Point> {
        times.iter().map(|&cpu| Point { rounds: 1, cpu, error: 0.3 * cpu.powf(exponent) }).collect()
    }

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        for exponent in [-0.5, -1.0, -1.0 / 3.0, 0.0] {
            let found = slope(&law(exponent, &[0.1, 0.25, 1.0, 7.0])).unwrap();
            assert!((found - exponent).abs() < 1e-12, "{found}");
        }
        assert_eq!(slope(&law(-0.5, &[1.0])), None);
    }

    #[test]
    fn the_tail_is_the_later_half_and_no_fewer_than_three() {
        let points = law(-0.5, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert_eq!(tail(&points), &points[4..]);
        assert_eq!(tail(&points[..4]), &points[1..4]);
        assert_eq!(tail(&points[..2]), &points[..2]);
    }

    /// On a power law the interpolation is exact: error 0.1 of 0.3 t^-1/2 is reached at 9 s.
    #[test]
    fn the_time_to_an_error_is_exact_on_a_power_law() {
        let points = law(-0.5, &[1.0, 4.0, 16.0]);
        assert!((time_to_reach(&points, 0.1).unwrap() - 9.0).abs() < 1e-9);
        assert_eq!(time_to_reach(&points, 0.5), Some(1.0));
        assert_eq!(time_to_reach(&points, 0.01), None);
    }
}
