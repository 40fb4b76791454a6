//! Binary glTF: the container, and a description that has been checked against it.

use super::ImportError;
use gltf::accessor::{DataType, Dimensions};
use gltf::json::Root;
use gltf::json::camera::Type;
use gltf::json::validation::Checked;
use gltf::{Accessor, Document, Gltf};

/// What is read of the extensions of glTF.
pub(super) const EXTENSIONS: [&str; 6] = [
    "KHR_lights_punctual",
    "KHR_materials_transmission",
    "KHR_materials_ior",
    "KHR_materials_volume",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
];

/// Most errors of a description that are listed.
const MAX_LISTED: usize = 10;

/// A model whose references all lie within its data.
pub(super) struct Model {
    pub(super) document: Document,
    data: Vec<u8>,
}

impl Model {
    pub(super) fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        check_header(bytes)?;
        let gltf = Gltf::from_slice_without_validation(bytes)
            .map_err(|error| ImportError::Container(error.to_string()))?;
        let data = gltf.blob.unwrap_or_default();
        let mut root = gltf.document.into_json();
        // The crate calls some extensions unknown although it reads them.
        root.extensions_required.retain(|extension| !EXTENSIONS.contains(&extension.as_str()));
        check(&root, data.len())?;
        let document = Document::from_json(root).map_err(|error| match error {
            gltf::Error::Validation(errors) => {
                let listed: Vec<String> =
                    errors.iter().take(MAX_LISTED).map(|(path, e)| format!("{path}: {e}")).collect();
                content("description", listed.join("; "))
            }
            other => content("description", other.to_string()),
        })?;
        Ok(Self { document, data })
    }

    /// All of the model's data, for the readers of the crate.
    pub(super) fn data(&self) -> &[u8] {
        &self.data
    }

    /// The bytes of a view; it lies within the data.
    pub(super) fn view(&self, view: &gltf::buffer::View<'_>) -> &[u8] {
        self.data.get(view.offset()..view.offset() + view.length()).unwrap_or_default()
    }

    /// Refuses an accessor that is not made of such items, or whose items do not all lie within its view.
    pub(super) fn check_accessor(
        &self,
        accessor: &Accessor<'_>,
        dimensions: Dimensions,
        types: &[DataType],
    ) -> Result<(), ImportError> {
        let wrong = |reason: &str| content(format!("accessors[{}]", accessor.index()), reason);
        if accessor.sparse().is_some() {
            return Err(wrong("sparse accessors are not read"));
        }
        if accessor.dimensions() != dimensions || !types.contains(&accessor.data_type()) {
            return Err(wrong(&format!("expected {dimensions:?} of one of {types:?}")));
        }
        let Some(view) = accessor.view() else { return Err(wrong("it has no view")) };
        let size = accessor.size();
        let stride = view.stride().unwrap_or(size);
        let end = accessor
            .count()
            .checked_sub(1)
            .and_then(|last| last.checked_mul(stride))
            .and_then(|start| start.checked_add(size)?.checked_add(accessor.offset()));
        if stride < size || end.is_none_or(|end| end > view.length()) {
            let reason = format!("{} items of {size} bytes do not fit into its view", accessor.count());
            return Err(wrong(&reason));
        }
        Ok(())
    }
}

pub(super) fn content(place: impl Into<String>, reason: impl Into<String>) -> ImportError {
    ImportError::Content { place: place.into(), reason: reason.into() }
}

/// Magic number, version and length; the crate takes the length on trust.
fn check_header(bytes: &[u8]) -> Result<(), ImportError> {
    let wrong = |reason: String| Err(ImportError::Container(reason));
    let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    if !bytes.starts_with(b"glTF") {
        return wrong("it does not begin with `glTF`".to_owned());
    }
    match (word(4), word(8)) {
        (Some(2), Some(length)) if length < 20 || u64::from(length) > bytes.len() as u64 => {
            wrong(format!("its header says {length} bytes, there are {}", bytes.len()))
        }
        (Some(2), Some(_)) => Ok(()),
        (Some(version), _) => wrong(format!("version {version} is not read, only 2")),
        (None, _) => wrong("its header is cut off".to_owned()),
    }
}

/// What the crate takes for granted.
fn check(root: &Root, data: usize) -> Result<(), ImportError> {
    for (index, buffer) in root.buffers.iter().enumerate() {
        let place = format!("buffers[{index}]");
        if index > 0 || buffer.uri.is_some() {
            return Err(content(place, "data outside of the file is not read"));
        }
        if buffer.byte_length.0 > data as u64 {
            let reason = format!("it says {} bytes, there are {data}", buffer.byte_length.0);
            return Err(content(place, reason));
        }
    }
    for (index, view) in root.buffer_views.iter().enumerate() {
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        let end = start.checked_add(view.byte_length.0);
        if view.buffer.value() > 0 || end.is_none_or(|end| end > data as u64) {
            return Err(content(format!("bufferViews[{index}]"), "it reaches beyond the data"));
        }
    }
    for (index, mesh) in root.meshes.iter().enumerate() {
        let attributes = mesh.primitives.iter().flat_map(|primitive| &primitive.attributes);
        // The crate's own check of positions follows such an index.
        if let Some((name, _)) = attributes.into_iter().find(|(_, i)| i.value() >= root.accessors.len()) {
            let reason = format!("the attribute {name:?} points at an accessor that does not exist");
            return Err(content(format!("meshes[{index}]"), reason));
        }
    }
    for (index, camera) in root.cameras.iter().enumerate() {
        let fits = match camera.type_ {
            Checked::Valid(Type::Perspective) => camera.perspective.is_some(),
            Checked::Valid(Type::Orthographic) => camera.orthographic.is_some(),
            Checked::Invalid => false,
        };
        if !fits {
            return Err(content(format!("cameras[{index}]"), "it is not what its type says"));
        }
    }
    for (index, image) in root.images.iter().enumerate() {
        if image.uri.is_none() && (image.buffer_view.is_none() || image.mime_type.is_none()) {
            return Err(content(format!("images[{index}]"), "it has neither data nor an address"));
        }
    }
    Ok(())
}
