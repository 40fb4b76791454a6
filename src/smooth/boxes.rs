//! Box filters over planes of a few channels, in time that does not depend on their width.

/// A plane of pixels row by row, of `C` channels each.
pub(super) type Plane<const C: usize> = Vec<[f32; C]>;

/// Sums (not divided by their number) over boxes of 2 `half` + 1 pixels each way, one box filter after the other. They are carried
/// on in f64: what a bright pixel leaves behind when it is taken away is far below f32's rounding.
pub(super) fn box_sums<const C: usize>(plane: &[[f32; C]], halves: &[usize], width: usize) -> Plane<C> {
    let mut plane = plane.to_vec();
    let mut across = vec![[0.0; C]; plane.len()];
    for &half in halves {
        sum_across(&plane, &mut across, half, width);
        sum_down(&across, &mut plane, half, width);
    }
    plane
}

fn sum_across<const C: usize>(from: &[[f32; C]], to: &mut [[f32; C]], half: usize, width: usize) {
    for (from, to) in from.chunks_exact(width).zip(to.chunks_exact_mut(width)) {
        let mut sum = [0.0_f64; C];
        let add = |sum: &mut [f64; C], value: &[f32; C]| {
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += f64::from(*value));
        };
        from.iter().take(half).for_each(|value| add(&mut sum, value));
        for (x, to) in to.iter_mut().enumerate() {
            if let Some(value) = from.get(x + half) {
                add(&mut sum, value);
            }
            *to = sum.map(|sum| sum as f32);
            if x >= half {
                sum.iter_mut().zip(&from[x - half]).for_each(|(sum, value)| *sum -= f64::from(*value));
            }
        }
    }
}

/// All columns at once.
fn sum_down<const C: usize>(from: &[[f32; C]], to: &mut [[f32; C]], half: usize, width: usize) {
    let row = width * C;
    let from: Vec<&[f32]> = from.as_flattened().chunks_exact(row).collect();
    let mut sums = vec![0.0_f64; row];
    let add = |sums: &mut [f64], values: &[f32]| {
        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += f64::from(*value));
    };
    from.iter().take(half).for_each(|values| add(&mut sums, values));
    for (y, to) in to.as_flattened_mut().chunks_exact_mut(row).enumerate() {
        if let Some(values) = from.get(y + half) {
            add(&mut sums, values);
        }
        to.iter_mut().zip(&sums).for_each(|(to, sum)| *to = *sum as f32);
        if y >= half {
            sums.iter_mut().zip(from[y - half]).for_each(|(sum, value)| *sum -= f64::from(*value));
        }
    }
}
