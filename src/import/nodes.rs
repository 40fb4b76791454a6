//! The nodes of a model: what stands where in the world.

use super::ImportError;
use super::container::{Model, content};
use glam::{DAffine3, DMat3, DVec3};
use gltf::{Camera, Mesh, Node};

/// Everything in the scene of a model with its transform to the world.
#[derive(Default)]
pub(super) struct Placed<'a> {
    pub(super) meshes: Vec<(Mesh<'a>, DAffine3, String)>,
    pub(super) lights: Vec<(gltf::khr_lights_punctual::Light<'a>, DAffine3)>,
    pub(super) cameras: Vec<(Camera<'a>, DAffine3)>,
}

/// Walks the nodes of the default scene, or of the first.
pub(super) fn collect(model: &Model) -> Result<Placed<'_>, ImportError> {
    let document = &model.document;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let scene = scene.ok_or_else(|| content("scenes", "there is none"))?;
    let mut placed = Placed::default();
    let mut visited = vec![false; document.nodes().len()];
    let mut stack: Vec<(Node<'_>, DAffine3)> = scene.nodes().map(|node| (node, DAffine3::IDENTITY)).collect();
    // First things first.
    stack.reverse();
    while let Some((node, parent)) = stack.pop() {
        let place = format!("nodes[{}]", node.index());
        // The nodes are a tree: a second visit would be a cycle, or a way to write 2^n nodes in n lines.
        match visited.get_mut(node.index()) {
            Some(seen) if !*seen => *seen = true,
            Some(_) | None => return Err(content(place, "it is the child of two nodes, or of itself")),
        }
        let to_world = parent * transform(&node);
        if !to_world.is_finite() {
            return Err(content(place, "its transform is not finite"));
        }
        if let Some(mesh) = node.mesh() {
            let name =
                node.name().or(mesh.name()).map_or_else(|| format!("mesh {}", mesh.index()), str::to_owned);
            placed.meshes.push((mesh, to_world, name));
        }
        placed.lights.extend(node.light().map(|light| (light, to_world)));
        placed.cameras.extend(node.camera().map(|camera| (camera, to_world)));
        let children: Vec<_> = node.children().map(|child| (child, to_world)).collect();
        stack.extend(children.into_iter().rev());
    }
    Ok(placed)
}

fn transform(node: &Node<'_>) -> DAffine3 {
    let [x, y, z, w] = node.transform().matrix().map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), w)
}
