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

/// Pixels beside one.
fn beside() -> impl Iterator<Item = (i32, i32)> {
    let row = |y: i32| (-REACH..=REACH).map(move |x| (x, y));
    (-REACH..=REACH).flat_map(row).filter(|&at| at != (0, 0))
}

impl EyeWalk<'_> {
    /// Notes that a sample sees what a pixel beside its own shows, if there is one, and what was looked up there.
    pub(super) fn borrow(&mut self, view: u32, arrival: &Arrival<'_>, gain: Vec3, looked_up: Vec3) {
        let Some(lender) = self.lender(view, arrival) else { return };
        let borrower = self.pixel;
        let mine = self.loans.iter_mut().rev().take_while(|loan| loan.borrower == borrower);
        let half = self.half;
        if let Some(loan) = mine.into_iter().find(|loan| loan.lender == lender) {
            loan.gain[half] += gain;
            loan.looked_up[half] += looked_up;
            return;
        }
        let mut loan = Loan { borrower, lender, gain: [Vec3::ZERO; 2], looked_up: [Vec3::ZERO; 2] };
        (loan.gain[half], loan.looked_up[half]) = (gain, looked_up);
        self.loans.push(loan);
    }

    fn lender(&self, view: u32, arrival: &Arrival<'_>) -> Option<u32> {
        let footprints = self.context.footprints;
        let (count, width) = footprints.size();
        let (plan, lens) = (self.context.plan, self.context.scene.camera.lens());
        // Through a lens no pixel has a footprint; what moves is not always where it is now; and named layers take apart
        // what a loan holds together.
        if count == 0 || lens.is_some() || plan.moves || plan.language.is_some() {
            return None;
        }
        let (column, row) = (self.pixel as usize % width, self.pixel as usize / width);
        let distance = |index: usize| {
            let footprint = footprints.get(index).filter(|footprint| footprint.view == view)?;
            shows(footprint, arrival)
        };
        let near = beside().filter_map(|(x, y)| {
            let column = column.checked_add_signed(x as isize).filter(|&column| column < width)?;
            let row = row.checked_add_signed(y as isize).filter(|&row| row < count / width)?;
            let index = row * width + column;
            Some((distance(index)?, index as u32))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
    }

    /// True if the branch may see what the pixel's neighbours show: it has no footprint itself.
    pub(super) fn at_border(&self, branch: &Branch) -> bool {
        branch.main && self.view.is_none()
    }
}

/// The squared distance of what the ray meets from the middle of a footprint, if it is on the same piece of surface and
/// near.
fn shows(footprint: &Footprint, arrival: &Arrival<'_>) -> Option<f32> {
    let surface = &arrival.hit.surface;
    let to = surface.point - footprint.center();
    let diagonal = (footprint.corners[2] - footprint.corners[0])
        .length_squared()
        .max((footprint.corners[3] - footprint.corners[1]).length_squared());
    let facing = surface.normal * -arrival.direction.dot(surface.normal).signum();
    let square = to.length_squared();
    let same = facing.dot(footprint.normal) >= SAME_FACE
        && square <= NEAR * NEAR * diagonal
        && to.dot(footprint.normal).abs() <= SAME_FOLD * square.sqrt();
    same.then_some(square)
}
