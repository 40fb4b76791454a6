//! Pixels at borders may borrow what photons bring from neighbours that show the same piece of surface.
//!
//! A pixel that shows parts of several surfaces has no footprint of its own to count photons on: they are looked up around
//! its eye samples. But each of these lands on a surface that some pixel beside it shows whole, whose irradiance, counted
//! on a footprint and smoothed, is less noisy, at the price of its being taken from a pixel or two aside. Both are kept:
//! the smoothing chooses.

use glam::Vec3;

/// What a pixel takes from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loan {
    /// The pixel that shows a border.
    pub borrower: u32,
    /// The pixel whose footprint lies beside it.
    pub lender: u32,
    /// The borrower's radiance per irradiance of the lender's footprint, summed over the eye samples of each half.
    pub gain: [Vec3; 2],
    /// What look-ups found in its place: radiance, summed over rounds by their photons' weight, in each half.
    pub looked_up: [Vec3; 2],
}

impl Loan {
    /// Bytes of a loan in a checkpoint.
    pub(super) const BYTES: usize = 4 * 14;

    fn key(&self) -> (u32, u32) {
        (self.borrower, self.lender)
    }

    /// Adds more loans to some in the order of borrowers and lenders, which is kept.
    pub(super) fn merge(into: &mut Vec<Self>, more: &[Self]) {
        into.extend_from_slice(more);
        // Stable: what was there comes first, so that sums are formed in the order of rounds.
        into.sort_by_key(Self::key);
        into.dedup_by(|next, first| {
            let same = next.key() == first.key();
            if same {
                for half in 0..2 {
                    first.gain[half] += next.gain[half];
                    first.looked_up[half] += next.looked_up[half];
                }
            }
            same
        });
    }

    /// Its pixels and numbers, in a fixed order.
    pub(super) fn words(&self) -> impl Iterator<Item = u32> + '_ {
        let vectors = self.gain.iter().chain(&self.looked_up);
        [self.borrower, self.lender].into_iter().chain(vectors.flat_map(|v| v.to_array()).map(f32::to_bits))
    }

    /// The inverse of [`Loan::words`].
    pub(super) fn from_words(mut word: impl FnMut() -> u32) -> Self {
        let (borrower, lender) = (word(), word());
        let mut vector = || Vec3::from_array(std::array::from_fn(|_| f32::from_bits(word())));
        let mut halves = || [vector(), vector()];
        Self { borrower, lender, gain: halves(), looked_up: halves() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loans_of_the_same_pixels_add_up_in_order() {
        let loan = |borrower, lender, g: f32| Loan {
            borrower,
            lender,
            gain: [Vec3::splat(g), Vec3::splat(2.0 * g)],
            looked_up: [Vec3::splat(-g), Vec3::X * g],
        };
        let mut loans = Vec::new();
        Loan::merge(&mut loans, &[loan(7, 3, 1.0), loan(2, 9, 4.0), loan(7, 3, 2.0)]);
        Loan::merge(&mut loans, &[loan(7, 1, 1.0), loan(2, 9, 0.5)]);
        assert_eq!(loans, [loan(2, 9, 4.5), loan(7, 1, 1.0), loan(7, 3, 3.0)]);
        for loan in &loans {
            let mut words = loan.words();
            assert_eq!(Loan::from_words(|| words.next().unwrap()), *loan);
            assert_eq!(4 * loan.words().count(), Loan::BYTES);
        }
    }
}
