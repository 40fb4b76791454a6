//! Writes small models in binary glTF.

use serde_json::{Value, json};

/// A model that grows: the description, and the data that it points into.
pub(crate) struct Glb {
    pub(crate) json: Value,
    pub(crate) data: Vec<u8>,
}

impl Glb {
    /// A model with one scene and no node.
    pub(crate) fn new() -> Self {
        let json = json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [] });
        Self { json, data: Vec::new() }
    }

    pub(crate) fn push(&mut self, list: &str, entry: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let entries = self.json[list].as_array_mut().unwrap();
        entries.push(entry);
        entries.len() - 1
    }

    /// A view over bytes that are added to the data.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.data.len();
        self.data.extend(bytes);
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    pub(crate) fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][N];
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|i| values.iter().map(|v| v[i]).reduce(pick).unwrap()).collect()
        };
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind,
                    "min": bound(f32::min), "max": bound(f32::max) }),
        )
    }

    pub(crate) fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": 5123, "count": values.len(), "type": "SCALAR" }),
        )
    }

    pub(crate) fn picture(&mut self, png: &[u8]) -> usize {
        let view = self.view(png);
        let image = self.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
        self.push("textures", json!({ "source": image }))
    }

    pub(crate) fn material(&mut self, material: Value) -> usize {
        self.push("materials", material)
    }

    /// A square of side 2 in the plane z = 0, facing +z, with normals, texture coordinates and indices.
    pub(crate) fn square(&mut self, material: usize) -> usize {
        let positions =
            self.floats(&[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]);
        let normals = self.floats(&[[0.0, 0.0, 1.0]; 4]);
        let uvs = self.floats(&[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        let indices = self.indices(&[0, 1, 2, 0, 2, 3]);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs });
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
        self.push("meshes", json!({ "name": "square", "primitives": [primitive] }))
    }

    /// A node at the root of the scene.
    pub(crate) fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(index.into());
        index
    }

    /// A light in a node at the root.
    pub(crate) fn light(&mut self, light: Value, mut node: Value) {
        let extension = &mut self.json["extensions"]["KHR_lights_punctual"]["lights"];
        if extension.is_null() {
            *extension = json!([]);
        }
        let lights = extension.as_array_mut().unwrap();
        lights.push(light);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": lights.len() - 1 } });
        self.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        self.node(node);
    }

    /// The file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut description = self.json.clone();
        if !self.data.is_empty() {
            description["buffers"] = json!([{ "byteLength": self.data.len() }]);
        }
        // Empty lists are not allowed.
        description.as_object_mut().unwrap().retain(|_, v| v.as_array().is_none_or(|list| !list.is_empty()));
        let mut text = description.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunk =
            |kind: &[u8; 4], bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], kind, bytes].concat();
        let chunks = [chunk(b"JSON", &text), chunk(b"BIN\0", &self.data)].concat();
        let length = (12 + chunks.len()) as u32;
        [&b"glTF"[..], &2_u32.to_le_bytes(), &length.to_le_bytes(), &chunks].concat()
    }
}
