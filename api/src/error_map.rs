//! Relative errors as colours: dark is exact, bright is wrong; equal steps of colour are equal factors.

/// The least and the greatest error that are told apart.
const RANGE: [f32; 2] = [0.001, 1.0];

/// Stops of the colour map, sRGB, from exact to wrong: lightness rises throughout, so that it reads in grey too.
const STOPS: [[u8; 3]; 7] =
    [[4, 5, 16], [43, 16, 84], [112, 26, 110], [181, 49, 88], [236, 96, 39], [251, 176, 26], [252, 250, 190]];

/// The linear colour of a relative error.
#[must_use]
pub(crate) fn color(error: f32) -> [f32; 3] {
    let [least, most] = RANGE;
    let along = (error.clamp(least, most) / least).ln() / (most / least).ln();
    // An error that is not a number is as wrong as can be.
    let along = if along.is_finite() { along } else { 1.0 } * (STOPS.len() - 1) as f32;
    let index = (along as usize).min(STOPS.len() - 2);
    let part = along - index as f32;
    let linear = |code: u8| nephroid::develop::srgb_to_linear(f64::from(code) / 255.0) as f32;
    std::array::from_fn(|k| {
        let [a, b] = [linear(STOPS[index][k]), linear(STOPS[index + 1][k])];
        a + part * (b - a)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_greater_error_is_brighter() {
        let luminance =
            |error| color(error).into_iter().zip([0.2126, 0.7152, 0.0722]).map(|(c, w)| c * w).sum();
        let shown: Vec<f32> = [0.0, 0.001, 0.003, 0.01, 0.05, 0.2, 0.9, 5.0].map(luminance).to_vec();
        assert!(shown.is_sorted(), "{shown:?}");
        assert!(shown[0] == shown[1] && shown[6] < shown[7]);
        assert_eq!(color(f32::NAN), color(9.0));
    }
}
