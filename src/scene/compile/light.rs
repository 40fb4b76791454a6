//! Lights of the scene file; those that have an area also become surfaces that are seen.

use super::super::issue::IssueCode;
use super::super::light_file::{DirectionalLightFile, LightFile, QuadLightFile, SpotLightFile};
use super::super::{
    DiskLight, Light, LightId, Material, MaterialId, Object, QuadLight, SphereLight, SpotLight, Texture,
};
use super::{Compiler, vec3};
use glam::{DVec3, Vec3};

/// Least sine of the angle between a quad light's edge and its normal.
const MIN_EDGE_SINE: f64 = 1e-5;

/// Least angle of a spot's cone, degrees: below it floats no longer tell its cosine from 1.
const MIN_CONE: f64 = 0.1;

impl Compiler<'_> {
    pub(super) fn lights(&mut self, lights: &[Option<LightFile>]) {
        for (index, light) in lights.iter().enumerate() {
            let Some(file) = light.as_ref() else { continue };
            let Some(light) = self.light(file, index) else { continue };
            if light.surface_radiance().is_some() {
                self.light_surface(&light, index);
            }
            self.light_places.push(format!("/lights/{index}"));
            self.lights.push(light);
            let group = self.light_group(file.group(), &format!("/lights/{index}"));
            self.light_groups.of_light.push(group);
        }
    }

    fn light(&mut self, light: &LightFile, index: usize) -> Option<Light> {
        Some(match light {
            LightFile::Point(point) => {
                Light::Point { position: vec3(point.position), intensity: vec3(point.intensity) }
            }
            LightFile::Spot(spot) => Light::Spot(self.spot_light(spot, index)?),
            LightFile::Directional(DirectionalLightFile { direction, irradiance, .. }) => {
                let direction = DVec3::from(*direction).normalize().as_vec3();
                Light::Directional { direction, irradiance: vec3(*irradiance) }
            }
            LightFile::Quad(quad) => Light::Quad(self.quad_light(quad, index)?),
            LightFile::Disk(disk) => Light::Disk(DiskLight {
                center: vec3(disk.center),
                radius: disk.radius as f32,
                normal: self.facing(disk.center, disk.towards, index)?.as_vec3(),
                radiance: vec3(disk.radiance),
            }),
            LightFile::Sphere(sphere) => Light::Sphere(SphereLight {
                center: vec3(sphere.center),
                radius: sphere.radius as f32,
                radiance: vec3(sphere.radiance),
            }),
        })
    }

    /// Adds the surface of the light that comes next.
    fn light_surface(&mut self, light: &Light, index: usize) {
        let material = self.black();
        let emitter = Some(LightId(self.lights.len() as u32));
        let object = self.add_object(Object { name: format!("lights/{index}"), material, emitter });
        match light {
            Light::Quad(quad) => {
                if let Err(error) = self.geometry.polygon(object, &[quad.corners().to_vec()]) {
                    let message = format!("too small for its distance from the origin: {error}");
                    self.issues.add(format!("/lights/{index}/size"), IssueCode::Degenerate, message);
                }
            }
            Light::Disk(disk) => self.geometry.disk(object, disk.center, disk.normal, disk.radius),
            Light::Sphere(sphere) => self.geometry.sphere(object, sphere.center, sphere.radius),
            Light::Point { .. } | Light::Spot(_) | Light::Directional { .. } | Light::Mesh(_) => {}
        }
    }

    /// Unit vector from a light to the point it faces.
    fn facing(&mut self, from: [f64; 3], towards: [f64; 3], index: usize) -> Option<DVec3> {
        let facing = (DVec3::from(towards) - DVec3::from(from)).try_normalize();
        if facing.is_none() {
            let message = "`towards` must differ from the light's place: the light faces nowhere";
            self.issues.add(format!("/lights/{index}/towards"), IssueCode::Degenerate, message);
        }
        facing
    }

    fn spot_light(&mut self, spot: &SpotLightFile, index: usize) -> Option<SpotLight> {
        let pointer = |field: &str| format!("/lights/{index}/{field}");
        let axis = match (spot.direction, spot.towards) {
            (Some(direction), None) => DVec3::from(direction).normalize(),
            (None, Some(towards)) => self.facing(spot.position, towards, index)?,
            (Some(_), Some(_)) => {
                let message = "`towards` cannot be given together with `direction`";
                self.issues.add(pointer("towards"), IssueCode::ConflictingFields, message);
                return None;
            }
            (None, None) => {
                let message = "the field `direction` is missing: a spot has that or `towards`";
                self.issues.add(pointer("direction"), IssueCode::MissingField, message);
                return None;
            }
        };
        let inner = spot.inner.unwrap_or(0.8 * spot.outer);
        if inner > spot.outer || spot.outer < MIN_CONE {
            let (field, message) = match inner > spot.outer {
                true => ("inner", format!("the inner cone must not be wider than the outer, {}", spot.outer)),
                false => ("outer", format!("a cone below {MIN_CONE} degrees is a line: it has no light")),
            };
            self.issues.add(pointer(field), IssueCode::OutOfRange, message);
            return None;
        }
        let half_cosine = |angle: f64| libm::cos(angle.to_radians() / 2.0) as f32;
        Some(SpotLight {
            position: vec3(spot.position),
            axis: axis.as_vec3(),
            intensity: vec3(spot.intensity),
            cos_inner: half_cosine(inner),
            cos_outer: half_cosine(spot.outer),
        })
    }

    /// What the surface of a light is made of: it reflects nothing.
    fn black(&mut self) -> MaterialId {
        let black = Material::Diffuse { albedo: Texture::Constant(Vec3::ZERO) };
        match self.materials.iter().position(|material| *material == black) {
            Some(index) => MaterialId(index as u32),
            None => self.add_material(black),
        }
    }

    fn quad_light(&mut self, quad: &QuadLightFile, index: usize) -> Option<QuadLight> {
        let center = DVec3::from(quad.center);
        let normal = self.facing(quad.center, quad.towards, index)?;
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
        let halves =
            [across * (width / 2.0), normal.cross(across) * (height / 2.0)].map(|half| half.as_vec3());
        Some(QuadLight::new(center.as_vec3(), halves, normal.as_vec3(), vec3(quad.radiance)))
    }
}
