//! Lights of the scene file; a quad light also becomes a surface that is seen.

use super::super::file::{DirectionalLightFile, LightFile, QuadLightFile};
use super::super::issue::IssueCode;
use super::super::{Light, LightId, Material, MaterialId, Object, QuadLight, Texture};
use super::{Compiler, vec3};
use glam::{DVec3, Vec3};

/// Least sine of the angle between a quad light's edge and its normal.
const MIN_EDGE_SINE: f64 = 1e-5;

impl Compiler<'_> {
    pub(super) fn lights(&mut self, lights: &[Option<LightFile>]) {
        let mut surface = None;
        for (index, light) in lights.iter().enumerate() {
            let Some(light) = light else { continue };
            let id = LightId(self.lights.len() as u32);
            match light {
                LightFile::Point(point) => {
                    let (position, intensity) = (vec3(point.position), vec3(point.intensity));
                    self.lights.push(Light::Point { position, intensity });
                }
                LightFile::Directional(DirectionalLightFile { direction, irradiance }) => {
                    let direction = DVec3::from(*direction).normalize().as_vec3();
                    self.lights.push(Light::Directional { direction, irradiance: vec3(*irradiance) });
                }
                LightFile::Quad(quad) => {
                    let Some(quad) = self.quad_light(quad, index) else { continue };
                    let material = *surface.get_or_insert_with(|| self.black());
                    let name = format!("lights/{index}");
                    let object = self.add_object(Object { name, material, emitter: Some(id) });
                    if let Err(error) = self.geometry.polygon(object, &[quad.corners().to_vec()]) {
                        let message = format!("too small for its distance from the origin: {error}");
                        self.issues.add(format!("/lights/{index}/size"), IssueCode::Degenerate, message);
                    }
                    self.lights.push(Light::Quad(quad));
                }
            }
        }
    }

    /// What the surface of a light is made of: it reflects nothing.
    fn black(&mut self) -> MaterialId {
        self.add_material(Material::Diffuse { albedo: Texture::Constant(Vec3::ZERO) })
    }

    fn quad_light(&mut self, quad: &QuadLightFile, index: usize) -> Option<QuadLight> {
        let center = DVec3::from(quad.center);
        let Some(normal) = (DVec3::from(quad.towards) - center).try_normalize() else {
            let message = "`towards` must differ from `center`: the light faces nowhere";
            self.issues.add(format!("/lights/{index}/towards"), IssueCode::Degenerate, message);
            return None;
        };
        let across = match quad.edge {
            Some(edge) => {
                let edge = DVec3::from(edge).normalize();
                if edge.cross(normal).length() < MIN_EDGE_SINE {
                    let message = "`edge` must not be parallel to the direction from `center` to `towards`";
                    self.issues.add(format!("/lights/{index}/edge"), IssueCode::Degenerate, message);
                    return None;
                }
                edge.reject_from_normalized(normal).normalize()
            }
            // Horizontal; of a light that looks straight up or down, along x.
            None => DVec3::Y.cross(normal).try_normalize().unwrap_or(DVec3::X),
        };
        let [width, height] = quad.size;
        Some(QuadLight {
            center: center.as_vec3(),
            half_u: (across * (width / 2.0)).as_vec3(),
            half_v: (normal.cross(across) * (height / 2.0)).as_vec3(),
            normal: normal.as_vec3(),
            radiance: vec3(quad.radiance),
        })
    }
}
