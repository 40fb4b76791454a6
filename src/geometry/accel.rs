//! The structure over the primitives: a plain list for a handful, a bounding-volume hierarchy for more.

use super::{Bounds, Ray};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray as BvhRay, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use std::time::Duration;

/// Up to this many primitives are simply tested one after the other. Measured on spheres and polygons: the
/// hierarchy's eight-wide nodes win from about a dozen on.
const LIST_LIMIT: usize = 8;

/// How the nearest primitive is found.
pub(super) enum Accel {
    /// Every primitive is tested; holds how many there are.
    List(usize),
    /// A compressed eight-wide hierarchy of boxes (Ylitie et al. 2017), built by `obvhs`.
    Bvh(Box<CwBvh>),
}

impl std::fmt::Debug for Accel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.min.into(), self.max.into())
    }
}

impl Accel {
    /// Builds the structure; also returns which primitive goes into which slot.
    pub(super) fn build(bounds: &[Bounds]) -> (Self, Vec<u32>) {
        if bounds.len() <= LIST_LIMIT {
            return (Self::List(bounds.len()), (0..bounds.len() as u32).collect());
        }
        let mut build_time = Duration::ZERO;
        let mut bvh = build_cwbvh(bounds, BvhBuildParams::medium_build(), &mut build_time);
        let order = std::mem::take(&mut bvh.primitive_indices);
        (Self::Bvh(Box::new(bvh)), order)
    }

    /// Visits slots nearest first as far as the structure knows. `test` gets a slot and the distance beyond
    /// which it need not look, and returns the distance of a hit nearer than that.
    #[inline]
    pub(super) fn closest(&self, ray: &Ray, mut test: impl FnMut(usize, f32) -> Option<f32>) {
        match self {
            Self::List(count) => {
                let mut t_max = f32::INFINITY;
                for slot in 0..*count {
                    if let Some(t) = test(slot, t_max) {
                        t_max = t;
                    }
                }
            }
            Self::Bvh(bvh) => {
                let ray = bvh_ray(ray, f32::INFINITY);
                bvh.ray_traverse(ray, &mut RayHit::none(), |ray, slot| {
                    test(slot, ray.tmax).unwrap_or(f32::INFINITY)
                });
            }
        }
    }

    /// True if `test` holds for any slot on the ray before `t_max`.
    #[inline]
    pub(super) fn any(&self, ray: &Ray, t_max: f32, mut test: impl FnMut(usize) -> bool) -> bool {
        match self {
            Self::List(count) => (0..*count).any(test),
            Self::Bvh(bvh) => {
                !bvh.ray_traverse_miss(
                    bvh_ray(ray, t_max),
                    |_, slot| {
                        if test(slot) { 0.0 } else { f32::INFINITY }
                    },
                )
            }
        }
    }

    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::List(_) => "list",
            Self::Bvh(_) => "bvh",
        }
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        match self {
            Self::List(_) => 0,
            Self::Bvh(bvh) => size_of_val(&bvh.nodes[..]) as u64,
        }
    }
}

#[inline]
fn bvh_ray(ray: &Ray, t_max: f32) -> BvhRay {
    BvhRay::new(ray.origin.into(), ray.direction.into(), 0.0, t_max)
}
