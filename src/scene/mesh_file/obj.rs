//! OBJ meshes: the positions, normals, texture coordinates and faces; all groups as one mesh.

use super::{MeshFileError, at};
use crate::geometry::MeshData;
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Reads an OBJ file. Faces with more than three corners become fans.
pub(super) fn decode(text: &str) -> Result<MeshData, MeshFileError> {
    let mut obj = Obj::default();
    for (index, line) in text.lines().enumerate() {
        obj.line(line).map_err(|reason| at(format!("line {}", index + 1), reason))?;
    }
    obj.into_mesh()
}

/// The file's own arrays, and the mesh made of the corners of its faces.
#[derive(Default)]
struct Obj {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    vertices: HashMap<Corner, u32>,
    mesh: MeshData,
}

/// Indices of a corner into the file's arrays.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: usize,
    uv: Option<usize>,
    normal: Option<usize>,
}

impl Obj {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => self.positions.push(Vec3::from(numbers(words)?)),
            Some("vn") => self.normals.push(Vec3::from(numbers(words)?)),
            Some("vt") => self.uvs.push(Vec2::from(numbers(words)?)),
            Some("f") => self.face(words)?,
            // Names, groups, materials, lines, points, curves: nothing that a mesh is made of.
            Some(_) | None => {}
        }
        Ok(())
    }

    fn face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<(), String> {
        let mut first = None;
        let mut previous = None;
        let mut corners = 0;
        for word in words {
            let corner = self.corner(word)?;
            let vertex = self.vertex(corner)?;
            corners += 1;
            if let (Some(first), Some(previous)) = (first, previous) {
                self.mesh.triangles.push([first, previous, vertex]);
            }
            if first.is_some() {
                previous = Some(vertex);
            } else {
                first = Some(vertex);
            }
        }
        if corners < 3 { Err(format!("a face has at least 3 corners, this has {corners}")) } else { Ok(()) }
    }

    fn corner(&self, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let position = index(parts.next().unwrap_or_default(), self.positions.len())?;
        let mut next = |length| match parts.next() {
            None | Some("") => Ok(None),
            Some(part) => index(part, length).map(Some),
        };
        let (uv, normal) = (next(self.uvs.len())?, next(self.normals.len())?);
        match parts.next() {
            Some(_) => Err("a corner is at most position/texture/normal".to_owned()),
            None => Ok(Corner { position, uv, normal }),
        }
    }

    fn vertex(&mut self, corner: Corner) -> Result<u32, String> {
        if let Some(&known) = self.vertices.get(&corner) {
            return Ok(known);
        }
        let id = u32::try_from(self.mesh.positions.len()).map_err(|_| "too many vertices".to_owned())?;
        self.mesh.positions.extend(self.positions.get(corner.position));
        self.mesh.uvs.extend(corner.uv.and_then(|uv| self.uvs.get(uv)));
        self.mesh.normals.extend(corner.normal.and_then(|normal| self.normals.get(normal)));
        self.vertices.insert(corner, id);
        Ok(id)
    }

    fn into_mesh(self) -> Result<MeshData, MeshFileError> {
        let vertices = self.mesh.positions.len();
        for (what, given) in
            [("normals", self.mesh.normals.len()), ("texture coordinates", self.mesh.uvs.len())]
        {
            if given != 0 && given != vertices {
                return Err(at("faces", format!("some corners have {what} and others do not")));
            }
        }
        if self.mesh.triangles.is_empty() {
            return Err(at("file", "there is no face in it; expected a PLY or OBJ mesh"));
        }
        Ok(self.mesh)
    }
}

fn numbers<'w, const N: usize>(mut words: impl Iterator<Item = &'w str>) -> Result<[f32; N], String> {
    let mut out = [0.0; N];
    for slot in &mut out {
        let word = words.next().ok_or_else(|| format!("expected {N} numbers"))?;
        *slot = word.parse().map_err(|_| format!("expected {N} numbers"))?;
    }
    Ok(out)
}

/// An index counted from 1, or backwards from the end if negative.
fn index(word: &str, length: usize) -> Result<usize, String> {
    let wrong = || format!("expected an index from 1 to {length}");
    let number: i64 = word.parse().map_err(|_| wrong())?;
    let counted = if number < 0 {
        i64::try_from(length).ok().and_then(|l| l.checked_add(number))
    } else {
        number.checked_sub(1)
    };
    counted.and_then(|i| usize::try_from(i).ok()).filter(|i| *i < length).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_shared_where_all_their_indices_agree() {
        let text = "# a fold\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\no one\n\
            f 1//1 2//1 3//1\nf -4//-2 3//1 4//2 # shares two\n";
        let mesh = decode(text).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.normals[3], Vec3::Y);
        assert!(mesh.uvs.is_empty());
    }

    #[test]
    fn a_polygon_becomes_a_fan() {
        let mesh =
            decode("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 4/1 5/1").unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        assert_eq!(mesh.uvs.len(), 5);
    }

    #[test]
    fn bad_lines_are_errors_that_name_the_line() {
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
        for line in [
            "f 1 2",
            "f 1 2 4",
            "f 0 1 2",
            "f 1 2 -4",
            "f 1 2 x",
            "f 1/2 2/1 3/1",
            "f 1//1 2//1 3//1",
            "f 1/1/1/1 2 3",
            "f 1 2 -9223372036854775808",
            "f 1 2 99999999999999999999",
            "v 1 2",
            "vn 1 2 z",
        ] {
            let error = decode(&format!("{vertices}{line}\nf 1 2 3\n")).unwrap_err();
            assert!(error.to_string().starts_with("line 5"), "{line}: {error}");
        }
        decode(&format!("{vertices}f 1/1 2/1 3\n")).unwrap_err();
        decode(vertices).unwrap_err();
    }
}
