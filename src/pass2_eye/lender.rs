//! Pass 2, `DS*E` at borders: the pixel beside one without a footprint whose own covers what an eye sample sees.

use super::footprint::Footprint;
use super::specular::{Branch, EyeWalk};
use crate::film::Loan;
use crate::optics::Arrival;
use glam::Vec3;

/// Pixels up to this far aside may lend.
const REACH: i32 = 2;

/// The sample lies at most this many diagonals of the footprint away from its middle.
const NEAR: f32 = 4.0;

/// Another fold of the same sheet is told by its normal (cosine of 18°), and by the slope of the way there.
const SAME_FACE: f32 = 0.95;
const SAME_FOLD: f32 = 0.35;

/// Pixels beside one, from near to far.
fn beside() -> impl Iterator<Item = (i32, i32)> {
    (1..=REACH * REACH * 2).flat_map(|square| {
        let row = move |y: i32| (-REACH..=REACH).map(move |x| (x, y));
        (-REACH..=REACH).flat_map(row).filter(move |(x, y)| x * x + y * y == square)
    })
}

impl EyeWalk<'_> {
    /// Notes that a sample sees what a pixel beside its own shows; false if there is none.
    pub(super) fn borrow(&mut self, view: u32, arrival: &Arrival<'_>, gain: Vec3) -> bool {
        let Some(lender) = self.lender(view, arrival) else { return false };
        let borrower = self.pixel;
        let mine = self.loans.iter_mut().rev().take_while(|loan| loan.borrower == borrower);
        let half = self.half;
        match mine.into_iter().find(|loan| loan.lender == lender) {
            Some(loan) => loan.gain[half] += gain,
            None => {
                let mut loan = Loan { borrower, lender, gain: [Vec3::ZERO; 2] };
                loan.gain[half] = gain;
                self.loans.push(loan);
            }
        }
        true
    }

    fn lender(&self, view: u32, arrival: &Arrival<'_>) -> Option<u32> {
        let footprints = self.context.footprints;
        let (count, width) = footprints.size();
        // What moves is not always where it is now, and named layers take apart what a loan holds together.
        if count == 0 || self.context.plan.moves || self.context.plan.language.is_some() {
            return None;
        }
        let (column, row) = (self.pixel as usize % width, self.pixel as usize / width);
        beside().find_map(|(x, y)| {
            let column = column.checked_add_signed(x as isize).filter(|&column| column < width)?;
            let row = row.checked_add_signed(y as isize).filter(|&row| row < count / width)?;
            let index = row * width + column;
            let footprint = footprints.get(index).filter(|footprint| footprint.view == view)?;
            shows(footprint, arrival).then_some(index as u32)
        })
    }

    /// True if the branch may see what the pixel's neighbours show: it has no footprint itself.
    pub(super) fn at_border(&self, branch: &Branch) -> bool {
        branch.main && self.view.is_none()
    }
}

/// True if what the ray meets is on the footprint's piece of surface, near to it.
fn shows(footprint: &Footprint, arrival: &Arrival<'_>) -> bool {
    let surface = &arrival.hit.surface;
    let to = surface.point - footprint.center();
    let diagonal = (footprint.corners[2] - footprint.corners[0])
        .length_squared()
        .max((footprint.corners[3] - footprint.corners[1]).length_squared());
    let facing = surface.normal * -arrival.direction.dot(surface.normal).signum();
    facing.dot(footprint.normal) >= SAME_FACE
        && to.length_squared() <= NEAR * NEAR * diagonal
        && to.dot(footprint.normal).abs() <= SAME_FOLD * to.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pixels_come_first_and_each_once() {
        let all: Vec<_> = beside().collect();
        assert_eq!(all.len(), 24);
        assert!(all[..4].iter().all(|(x, y)| x.abs() + y.abs() == 1));
        assert!(all.windows(2).all(|w| w[0].0.pow(2) + w[0].1.pow(2) <= w[1].0.pow(2) + w[1].1.pow(2)));
    }
}
