//! The lights of the scene file: exactly what the JSON says, nothing computed.

use super::read::{color, direction, name, optional, point, real, record, required, size2, tagged};

tagged! {
    /// A light.
    LightFile {
        "point" => Point(PointLightFile),
        "spot" => Spot(SpotLightFile),
        "directional" => Directional(DirectionalLightFile),
        "quad" => Quad(QuadLightFile),
        "disk" => Disk(DiskLightFile),
        "sphere" => Sphere(SphereLightFile),
    }
}

record! {
    /// A light that is a point.
    PointLightFile {
        /// Where it is.
        position: [f64; 3] = required(point()),
        /// Radiant intensity.
        intensity: [f64; 3] = required(color("intensity").unit("W·sr⁻¹")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// A point whose light is confined to a cone. With s = (cos θ - cos outer/2) / (cos inner/2 - cos outer/2),
    /// limited to 0..1, the intensity at an angle θ from the axis is s² (3 - 2s) times that on the axis.
    SpotLightFile {
        /// Where it is.
        position: [f64; 3] = required(point()),
        /// Direction of the axis; either this or `towards`.
        direction: Option<[f64; 3]> = optional(direction()),
        /// A point on the axis; either this or `direction`.
        towards: Option<[f64; 3]> = optional(point()),
        /// Radiant intensity on the axis.
        intensity: [f64; 3] = required(color("intensity").unit("W·sr⁻¹")),
        /// Opening angle of the cone beyond which there is no light, from side to side, in degrees.
        outer: f64 = required(real("opening angle in degrees").above(0.0).at_most(180.0).unit("°")),
        /// Opening angle of the cone within which the light is full, in degrees; 0.8 of `outer` if left out.
        inner: Option<f64> = optional(real("opening angle in degrees").between(0.0, 180.0).unit("°")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// Parallel light.
    DirectionalLightFile {
        /// The direction in which the light travels.
        direction: [f64; 3] = required(direction()),
        /// Irradiance on a surface that faces the light.
        irradiance: [f64; 3] = required(color("irradiance").unit("W·m⁻²")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// A rectangle that emits to one side.
    QuadLightFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Width and height.
        size: [f64; 2] = required(size2()),
        /// A point the light faces.
        towards: [f64; 3] = required(point()),
        /// Direction of the width; horizontal if left out.
        edge: Option<[f64; 3]> = optional(direction()),
        /// Radiance.
        radiance: [f64; 3] = required(color("radiance").unit("W·sr⁻¹·m⁻²")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// A disk that emits to one side.
    DiskLightFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Radius in metres.
        radius: f64 = required(real("radius in metres").positive_length()),
        /// A point the light faces.
        towards: [f64; 3] = required(point()),
        /// Radiance.
        radiance: [f64; 3] = required(color("radiance").unit("W·sr⁻¹·m⁻²")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

record! {
    /// A sphere that emits outwards.
    SphereLightFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Radius in metres.
        radius: f64 = required(real("radius in metres").positive_length()),
        /// Radiance.
        radiance: [f64; 3] = required(color("radiance").unit("W·sr⁻¹·m⁻²")),
        /// Its light group: the light of all lights of a group is a layer of this name, at no cost in rays. The light of all
        /// that is in no group is the layer `ungrouped`.
        group: Option<String> = optional(name()),
    }
}

impl LightFile {
    /// Its light group.
    pub(super) fn group(&self) -> Option<&str> {
        match self {
            Self::Point(PointLightFile { group, .. })
            | Self::Spot(SpotLightFile { group, .. })
            | Self::Directional(DirectionalLightFile { group, .. })
            | Self::Quad(QuadLightFile { group, .. })
            | Self::Disk(DiskLightFile { group, .. })
            | Self::Sphere(SphereLightFile { group, .. }) => group.as_deref(),
        }
    }
}
