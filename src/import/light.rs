//! Lights of a model (KHR_lights_punctual), and light for a model without any.

use super::nodes::Placed;
use super::{Import, short, short3};
use glam::{DAffine3, DVec3};
use gltf::khr_lights_punctual::{Kind, Light};
use serde_json::{Value, json};

/// Irradiance of the light that is added, and radiance of the environment.
const KEY: f32 = 3.0;
const FILL: f32 = 0.2;

impl Import {
    pub(super) fn lights(&mut self, placed: &Placed<'_>) {
        for (light, to_world) in &placed.lights {
            if light.range().is_some() {
                self.warn("range_ignored", "light has no range: it falls with the square of the distance");
            }
            let light = self.light(light, *to_world);
            self.lights.push(light);
        }
    }

    fn light(&mut self, light: &Light<'_>, to_world: DAffine3) -> Value {
        let strength = light.intensity().clamp(0.0, 1e12);
        let color = light.color().map(|c| (c.clamp(0.0, 1.0)) * strength);
        let position = to_world.translation;
        // Lights shine along their -z axis.
        let direction = to_world.transform_vector3(DVec3::NEG_Z).try_normalize().unwrap_or(DVec3::NEG_Z);
        let (middle, radius) = self.sphere();
        let distance2 = (middle - position).length_squared().max(radius * radius * 0.01);
        let [position, direction] = [position, direction].map(|v| short3(v.as_vec3().to_array()));
        let brightest = f64::from(color.iter().copied().fold(0.0, f32::max));
        match light.kind() {
            Kind::Directional => {
                self.irradiance += brightest;
                json!({ "type": "directional", "direction": direction, "irradiance": short3(color) })
            }
            Kind::Point => {
                self.irradiance += brightest / distance2;
                json!({ "type": "point", "position": position, "intensity": short3(color) })
            }
            Kind::Spot { inner_cone_angle, outer_cone_angle } => {
                self.irradiance += brightest / distance2;
                // Angles from the axis to the side; ours are from side to side.
                let outer = (2.0 * outer_cone_angle.to_degrees()).clamp(0.1, 180.0);
                let inner = (2.0 * inner_cone_angle.to_degrees()).clamp(0.0, outer);
                json!({ "type": "spot", "position": position, "direction": direction, "outer": short(outer),
                        "inner": short(inner), "intensity": short3(color) })
            }
        }
    }

    /// Adds a light and a faint environment to a model that has no light of its own.
    pub(super) fn light_if_dark(&mut self) {
        if self.emits || !self.lights.is_empty() {
            return;
        }
        self.irradiance = f64::from(KEY);
        self.lights.push(
            json!({ "type": "directional", "direction": [0.5, -1, -0.6], "irradiance": short3([KEY; 3]) }),
        );
        self.environment = Some(json!({ "radiance": short3([FILL; 3]) }));
        self.warn(
            "light_added",
            "the model has no light: a directional light and a faint environment are added",
        );
    }
}
