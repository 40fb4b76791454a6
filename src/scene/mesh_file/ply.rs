//! PLY meshes, as text or little-endian binary.

use super::{MeshFileError, at};
use crate::geometry::MeshData;
use glam::{Vec2, Vec3};
use std::str::SplitAsciiWhitespace;

/// Longest header.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// Reads a PLY file. Faces with more than three corners become fans.
pub(super) fn decode(bytes: &[u8]) -> Result<MeshData, MeshFileError> {
    let (header, body) = Header::read(bytes)?;
    let mut values = match header.format {
        Format::Ascii => {
            let text =
                std::str::from_utf8(body).map_err(|_| at("body", "not a text, though its header says so"))?;
            Values::Ascii(text.split_ascii_whitespace())
        }
        Format::LittleEndian => Values::Binary(body),
    };
    let mut mesh = MeshData::default();
    for element in &header.elements {
        element.check_size(header.format, values.bytes_left(body))?;
        match element.name.as_str() {
            "vertex" => read_vertices(element, &mut values, &mut mesh)?,
            "face" => read_faces(element, &mut values, &mut mesh)?,
            _ => skip(element, &mut values)?,
        }
    }
    Ok(mesh)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Ascii,
    LittleEndian,
}

struct Header {
    format: Format,
    elements: Vec<Element>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    /// Type of the length, of a list.
    length: Option<Scalar>,
    item: Scalar,
}

#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

impl Header {
    fn read(bytes: &[u8]) -> Result<(Self, &[u8]), MeshFileError> {
        const END: &[u8] = b"end_header";
        let start = bytes.get(..bytes.len().min(MAX_HEADER_BYTES)).unwrap_or_default();
        let end = start.windows(END.len()).position(|window| window == END);
        let (text, rest) = end
            .and_then(|end| Some((bytes.get(..end)?, bytes.get(end + END.len()..)?)))
            .ok_or_else(|| at("header", "there is no `end_header`"))?;
        let body = rest
            .strip_prefix(b"\r\n")
            .or_else(|| rest.strip_prefix(b"\n"))
            .ok_or_else(|| at("header", "expected a line break after `end_header`"))?;
        let text = std::str::from_utf8(text).map_err(|_| at("header", "not a text"))?;
        Ok((Self::parse(text)?, body))
    }

    fn parse(text: &str) -> Result<Self, MeshFileError> {
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let wrong = |reason: &str| at(format!("line {}", index + 1), reason);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                [] | ["ply" | "comment" | "obj_info", ..] => {}
                ["format", "ascii", "1.0"] => format = Some(Format::Ascii),
                ["format", "binary_little_endian", "1.0"] => format = Some(Format::LittleEndian),
                ["format", ..] => return Err(wrong("the format must be ascii or binary_little_endian, 1.0")),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| wrong("expected the number of elements"))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", property @ ..] => {
                    let property =
                        Property::parse(property).ok_or_else(|| wrong("this property is not known"))?;
                    let element =
                        elements.last_mut().ok_or_else(|| wrong("a property before any element"))?;
                    element.properties.push(property);
                }
                _ => return Err(wrong("this is not a line of a PLY header")),
            }
        }
        let format = format.ok_or_else(|| at("header", "there is no `format` line"))?;
        Ok(Self { format, elements })
    }
}

impl Property {
    fn parse(words: &[&str]) -> Option<Self> {
        let (length, item, name) = match words {
            ["list", length, item, name] => (Some(Scalar::parse(length)?), item, name),
            [item, name] => (None, item, name),
            _ => return None,
        };
        Some(Self { name: (*name).to_owned(), length, item: Scalar::parse(item)? })
    }
}

impl Element {
    /// Refuses counts that the bytes there are cannot hold, before anything is allocated for them.
    fn check_size(&self, format: Format, bytes_left: usize) -> Result<(), MeshFileError> {
        let least = |property: &Property| match format {
            Format::LittleEndian => property.length.unwrap_or(property.item).bytes(),
            // A digit and what separates it from the next.
            Format::Ascii => 2,
        };
        let record: usize = self.properties.iter().map(least).sum();
        if self.count > 0 && record == 0 {
            return Err(at(format!("element {}", self.name), "it has no properties"));
        }
        // The last value of a text needs no separator.
        let needed = self.count.saturating_mul(record);
        if needed > bytes_left.saturating_add(usize::from(format == Format::Ascii)) {
            let reason =
                format!("{} of them need at least {needed} bytes, there are {bytes_left}", self.count);
            return Err(at(format!("element {}", self.name), reason));
        }
        Ok(())
    }

    fn property(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| p.length.is_none() && names.contains(&p.name.as_str()))
    }
}

/// The numbers of the body, one after the other.
enum Values<'b> {
    Ascii(SplitAsciiWhitespace<'b>),
    Binary(&'b [u8]),
}

impl Values<'_> {
    /// For text only an upper bound: the whole body.
    fn bytes_left(&self, body: &[u8]) -> usize {
        match self {
            Self::Ascii(_) => body.len(),
            Self::Binary(rest) => rest.len(),
        }
    }

    fn next(&mut self, scalar: Scalar) -> Option<f64> {
        match self {
            Self::Ascii(words) => words.next()?.parse().ok(),
            Self::Binary(rest) => Some(match scalar {
                Scalar::I8 => f64::from(i8::from_le_bytes(take(rest)?)),
                Scalar::U8 => f64::from(u8::from_le_bytes(take(rest)?)),
                Scalar::I16 => f64::from(i16::from_le_bytes(take(rest)?)),
                Scalar::U16 => f64::from(u16::from_le_bytes(take(rest)?)),
                Scalar::I32 => f64::from(i32::from_le_bytes(take(rest)?)),
                Scalar::U32 => f64::from(u32::from_le_bytes(take(rest)?)),
                Scalar::F32 => f64::from(f32::from_le_bytes(take(rest)?)),
                Scalar::F64 => f64::from_le_bytes(take(rest)?),
            }),
        }
    }

    /// Length of a list, or an index.
    fn next_index(&mut self, scalar: Scalar) -> Option<u32> {
        let x = self.next(scalar)?;
        (x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x)).then_some(x as u32)
    }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = bytes.split_first_chunk::<N>()?;
    *bytes = rest;
    Some(*first)
}

/// Reads a property and hands on its value, or the values of its list.
fn read_property(property: &Property, values: &mut Values<'_>, mut use_value: impl FnMut(f64)) -> Option<()> {
    let length = match property.length {
        Some(scalar) => values.next_index(scalar)?,
        None => 1,
    };
    for _ in 0..length {
        use_value(values.next(property.item)?);
    }
    Some(())
}

fn broken(element: &Element, index: usize) -> MeshFileError {
    at(format!("{} {index}", element.name), "the data ends here or is not a number")
}

fn skip(element: &Element, values: &mut Values<'_>) -> Result<(), MeshFileError> {
    for index in 0..element.count {
        for property in &element.properties {
            read_property(property, values, |_| {}).ok_or_else(|| broken(element, index))?;
        }
    }
    Ok(())
}

fn read_vertices(
    element: &Element,
    values: &mut Values<'_>,
    mesh: &mut MeshData,
) -> Result<(), MeshFileError> {
    let find = |names: &[&str]| element.property(names);
    let three = |names: [&str; 3]| Some([find(&[names[0]])?, find(&[names[1]])?, find(&[names[2]])?]);
    let position =
        three(["x", "y", "z"]).ok_or_else(|| at("element vertex", "expected properties x, y, z"))?;
    let normal = three(["nx", "ny", "nz"]);
    let u = find(&["u", "s", "texture_u", "texture_s"]);
    let uv = u.zip(find(&["v", "t", "texture_v", "texture_t"]));
    let mut record = vec![0.0_f32; element.properties.len()];
    for index in 0..element.count {
        for (slot, property) in record.iter_mut().zip(&element.properties) {
            read_property(property, values, |x| *slot = x as f32).ok_or_else(|| broken(element, index))?;
        }
        let value = |i: usize| record.get(i).copied().unwrap_or(f32::NAN);
        mesh.positions.push(Vec3::from(position.map(value)));
        mesh.normals.extend(normal.map(|normal| Vec3::from(normal.map(value))));
        mesh.uvs.extend(uv.map(|(u, v)| Vec2::new(value(u), value(v))));
    }
    Ok(())
}

fn read_faces(element: &Element, values: &mut Values<'_>, mesh: &mut MeshData) -> Result<(), MeshFileError> {
    let is_corners =
        |p: &Property| p.length.is_some() && ["vertex_indices", "vertex_index"].contains(&p.name.as_str());
    if !element.properties.iter().any(is_corners) {
        return Err(at("element face", "expected a property list vertex_indices"));
    }
    for index in 0..element.count {
        for property in &element.properties {
            let done = if is_corners(property) {
                read_fan(property, values, &mut mesh.triangles)
            } else {
                read_property(property, values, |_| {})
            };
            done.ok_or_else(|| broken_face(index))?;
        }
    }
    Ok(())
}

fn broken_face(index: usize) -> MeshFileError {
    at(format!("face {index}"), "the data ends here, or it is not a list of three or more indices")
}

fn read_fan(property: &Property, values: &mut Values<'_>, triangles: &mut Vec<[u32; 3]>) -> Option<()> {
    let corners = values.next_index(property.length?)?;
    if corners < 3 {
        return None;
    }
    let first = values.next_index(property.item)?;
    let mut previous = values.next_index(property.item)?;
    for _ in 2..corners {
        let next = values.next_index(property.item)?;
        triangles.push([first, previous, next]);
        previous = next;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASCII: &str = "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n\
        0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n";

    fn binary() -> Vec<u8> {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
            property double y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
            element face 1\nproperty uchar red\nproperty list uchar uint vertex_index\nend_header\n"
            .to_vec();
        for [x, y, z] in [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
            bytes.extend(x.to_le_bytes());
            bytes.extend(f64::from(y).to_le_bytes());
            bytes.extend(z.to_le_bytes());
            bytes.extend([0.0_f32, 0.0, 1.0].into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend([255, 3]);
        bytes.extend([0_u32, 1, 2].into_iter().flat_map(u32::to_le_bytes));
        bytes
    }

    #[test]
    fn a_quad_becomes_a_fan() {
        let mesh = decode(ASCII.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(mesh.uvs[3], Vec2::new(0.0, 1.0));
        assert!(mesh.normals.is_empty());
    }

    #[test]
    fn line_ends_may_be_those_of_dos() {
        assert_eq!(decode(ASCII.replace('\n', "\r\n").as_bytes()), decode(ASCII.as_bytes()));
    }

    #[test]
    fn binary_types_are_read() {
        let mesh = decode(&binary()).unwrap();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn every_truncation_of_a_binary_file_is_an_error() {
        let bytes = binary();
        for length in 0..bytes.len() {
            decode(&bytes[..length]).unwrap_err();
        }
    }

    #[test]
    fn every_truncation_of_a_text_is_read_without_panic() {
        // The last line break may be missing, and a text cannot show that its last digits are.
        let last = ASCII.trim_end().len();
        for length in 0..last {
            decode(&ASCII.as_bytes()[..length]).unwrap_err();
        }
    }

    #[test]
    fn counts_are_checked_before_memory_is_taken() {
        for count in ["1000000000000", "18446744073709551615"] {
            let text = ASCII.replace("element vertex 4", &format!("element vertex {count}"));
            let error = decode(text.as_bytes()).unwrap_err();
            assert!(error.to_string().contains("there are"), "{error}");
        }
        decode(b"ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nend_header\n").unwrap_err();
    }

    #[test]
    fn bad_headers_and_faces_are_errors() {
        for (from, to) in [
            ("ascii 1.0", "binary_big_endian 1.0"),
            ("property float z\n", ""),
            ("float z", "quaternion z"),
            ("vertex_indices", "corners"),
            ("4 0 1 2 3", "2 0 1 2 3"),
            ("4 0 1 2 3", "4 0 1 2 -3"),
            ("4 0 1 2 3", "4 0 1 2 0.5"),
            ("4 0 1 2 3", "4000000000 0 1 2 3"),
            ("1 1 0 1 1", "1 1 zero 1 1"),
            ("element vertex 4\n", ""),
        ] {
            assert!(ASCII.contains(from), "{from}");
            decode(ASCII.replacen(from, to, 1).as_bytes()).unwrap_err();
        }
    }
}
