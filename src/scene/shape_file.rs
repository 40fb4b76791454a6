//! The shapes of the scene file: exactly what the JSON says, nothing computed.

use super::read::{
    Scale, direction, list, name, object, optional, or, point, real, record, required, size2, size3, tagged,
    triangle, uv,
};

tagged! {
    /// A shape.
    ShapeFile {
        "sphere" => Sphere(SphereFile),
        "polygon" => Polygon(PolygonFile),
        "mesh" => Mesh(MeshFile),
        "disk" => Disk(DiskFile),
        "cylinder" => Cylinder(CylinderFile),
        "box" => Box(BoxFile),
        "heightfield" => Heightfield(HeightfieldFile),
        "instance" => Instance(InstanceFile),
    }
}

record! {
    /// A flat disk.
    DiskFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Direction of its front.
        normal: [f64; 3] = or(direction(), [0.0, 1.0, 0.0]),
        /// Radius.
        radius: f64 = required(real("radius in metres").positive_length()),
    }
}

record! {
    /// A cylinder without its ends.
    CylinderFile {
        /// Middle of one end.
        from: [f64; 3] = required(point()),
        /// Middle of the other end.
        to: [f64; 3] = required(point()),
        /// Radius.
        radius: f64 = required(real("radius in metres").positive_length()),
    }
}

record! {
    /// A box along the axes.
    BoxFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Its three sides.
        size: [f64; 3] = required(size3()),
    }
}

record! {
    /// A surface of heights over a rectangle.
    HeightfieldFile {
        /// Centre of the rectangle.
        center: [f64; 3] = or(point(), [0.0; 3]),
        /// Its extent along x and z.
        size: [f64; 2] = required(size2()),
        /// Rows from low to high z, each from low to high x: heights above the centre.
        heights: Vec<Vec<f64>> = required(list(2, list(2, real("height in metres").unit("m")))),
    }
}

record! {
    /// Another object in another place. It is scaled, then turned, then moved.
    InstanceFile {
        /// Name of the object.
        of: String = required(name()),
        /// By how much it is moved.
        translate: [f64; 3] = or(point(), [0.0; 3]),
        /// By how much it is turned.
        rotate: Option<RotateFile> = optional(object::<RotateFile>()),
        /// By how much it is scaled, in all or along each of the axes.
        scale: [f64; 3] = or(Scale, [1.0; 3]),
    }
}

record! {
    /// The pose when the shutter closes, relative to that when it opens. In between, the angle and all else grow
    /// evenly.
    MotionFile {
        /// By how much it is moved.
        translate: [f64; 3] = or(point(), [0.0; 3]),
        /// By how much it is turned; several turns are possible.
        rotate: Option<RotateFile> = optional(object::<RotateFile>()),
        /// By how much it is scaled, in all or along each of the axes.
        scale: [f64; 3] = or(Scale, [1.0; 3]),
        /// The point about which it is turned and scaled, and which is only moved. If left out, that is for an
        /// instance its `translate`, for other objects the middle of their box.
        about: Option<[f64; 3]> = optional(point()),
    }
}

record! {
    /// A rotation about an axis, through the origin unless another point is named.
    RotateFile {
        /// The axis.
        axis: [f64; 3] = or(direction(), [0.0, 1.0, 0.0]),
        /// Degrees, anticlockwise seen against the axis.
        angle: f64 = required(real("angle in degrees").between(-3600.0, 3600.0).unit("°")),
    }
}

record! {
    /// A sphere.
    SphereFile {
        /// Centre.
        center: [f64; 3] = required(point()),
        /// Radius.
        radius: f64 = required(real("radius in metres").positive_length()),
    }
}

record! {
    /// A planar polygon, convex or not, by the even-odd rule: what lies within an even number of outlines is left out, as the
    /// middle of a pentagram.
    PolygonFile {
        /// The outline, anticlockwise seen from the front.
        vertices: Vec<[f64; 3]> = required(list(3, point())),
        /// Outlines of holes, in either order.
        holes: Vec<Vec<[f64; 3]>> = or(list(0, list(3, point())), Vec::new()),
    }
}

record! {
    /// A triangle mesh, here or in a file of its own.
    MeshFile {
        /// A PLY or OBJ file.
        asset: Option<String> = optional(name()),
        /// Positions of the vertices.
        positions: Option<Vec<[f64; 3]>> = optional(list(3, point())),
        /// Three indices of vertices per triangle.
        triangles: Option<Vec<[u32; 3]>> = optional(list(1, triangle())),
        /// A normal per vertex.
        normals: Option<Vec<[f64; 3]>> = optional(list(3, direction())),
        /// Texture coordinates per vertex.
        uvs: Option<Vec<[f64; 2]>> = optional(list(3, uv())),
    }
}
