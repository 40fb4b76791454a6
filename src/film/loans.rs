//! Pixels at borders borrow what photons bring from neighbours that show the same piece of surface.
//!
//! A pixel that shows parts of several surfaces has no footprint of its own to count photons on. Each of its eye
//! samples lands on the surface that some pixel beside it shows whole: that one's irradiance, counted on its footprint
//! and smoothed, is better known than what a look-up around the sample would find, at the price of its being taken from a
//! pixel or two aside.

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
}

impl Loan {
    /// Bytes of a loan in a checkpoint.
    pub(super) const BYTES: usize = 4 * 8;

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
                first.gain[0] += next.gain[0];
                first.gain[1] += next.gain[1];
            }
            same
        });
    }

    pub(super) fn to_words(self) -> [u32; 8] {
        let [a, b] = self.gain.map(|gain| gain.to_array().map(f32::to_bits));
        [self.borrower, self.lender, a[0], a[1], a[2], b[0], b[1], b[2]]
    }

    pub(super) fn from_words(words: [u32; 8]) -> Self {
        let [borrower, lender, a @ ..] = words;
        let [x, y, z, u, v, w] = a.map(f32::from_bits);
        Self { borrower, lender, gain: [Vec3::new(x, y, z), Vec3::new(u, v, w)] }
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
        };
        let mut loans = Vec::new();
        Loan::merge(&mut loans, &[loan(7, 3, 1.0), loan(2, 9, 4.0), loan(7, 3, 2.0)]);
        Loan::merge(&mut loans, &[loan(7, 1, 1.0), loan(2, 9, 0.5)]);
        assert_eq!(loans, [loan(2, 9, 4.5), loan(7, 1, 1.0), loan(7, 3, 3.0)]);
        assert!(loans.iter().all(|loan| Loan::from_words(loan.to_words()) == *loan));
    }
}
