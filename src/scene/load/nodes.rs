//! The node hierarchy: world transforms of everything that is placed in the scene.

use glam::{DMat4, DQuat, DVec3};
use gltf::json::scene::Node;
use gltf::json::{Index, Root};

use super::{Limits, Notes, Outcome};

/// A node of the chosen scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    /// Index of the node in the file.
    pub node: usize,
    /// Local to world.
    pub to_world: DMat4,
}

/// World transforms of all nodes, and those of the chosen scene in depth-first order.
pub(super) struct Hierarchy {
    /// In the order children are listed.
    pub placed: Vec<Placed>,
    /// By node index; identity for nodes outside the chosen scene. Joints may be any of them.
    pub world: Vec<DMat4>,
}

/// Walks the default scene (or the first, or all root nodes where the file has no scenes).
///
/// `start` is a map of the whole world. Fails on cycles, nodes with several parents, and hierarchies deeper than the
/// limit.
pub(super) fn walk(root: &Root, start: DMat4, limits: &Limits, notes: &mut Notes) -> Outcome<Hierarchy> {
    let parents = count_parents(root)?;
    let roots = scene_roots(root, &parents, notes)?;
    let mut hierarchy = Hierarchy { placed: Vec::new(), world: vec![DMat4::IDENTITY; root.nodes.len()] };
    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<(usize, DMat4, u32)> = roots.iter().rev().map(|&i| (i, start, 0)).collect();
    while let Some((i, parent, depth)) = stack.pop() {
        let node = root.nodes.get(i).ok_or_else(|| format!("node {i} does not exist"))?;
        if std::mem::replace(&mut visited[i], true) {
            return Err(format!("node {i} is reached twice: nodes must form a tree"));
        }
        if depth > limits.depth {
            return Err(format!("node {i} is nested deeper than the limit of {} levels", limits.depth));
        }
        let to_world = parent * local(node, i, notes);
        if !to_world.is_finite() {
            notes.fault(format!("node {i}: its transform is not finite; it was skipped with all below it"));
            continue;
        }
        hierarchy.world[i] = to_world;
        hierarchy.placed.push(Placed { node: i, to_world });
        for child in node.children.iter().flatten().rev() {
            stack.push((child.value(), to_world, depth + 1));
        }
    }
    Ok(hierarchy)
}

/// Number of parents of each node; fails on more than one and on cycles, wherever in the file they are.
fn count_parents(root: &Root) -> Outcome<Vec<u32>> {
    let mut parents = vec![0u32; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
        let count = parents.get_mut(child.value()).ok_or_else(|| format!("node {} does not exist", child.value()))?;
        *count += 1;
        if *count > 1 {
            return Err(format!("node {} has several parents", child.value()));
        }
    }
    // With at most one parent each, exactly the nodes of cycles cannot be reached from a node without parents.
    let mut reached = 0;
    let mut stack: Vec<usize> = (0..parents.len()).filter(|&i| parents[i] == 0).collect();
    while let Some(i) = stack.pop() {
        reached += 1;
        stack.extend(root.nodes[i].children.iter().flatten().map(Index::value));
    }
    if reached < parents.len() { Err("its nodes form a cycle".into()) } else { Ok(parents) }
}

fn scene_roots(root: &Root, parents: &[u32], notes: &mut Notes) -> Outcome<Vec<usize>> {
    if root.scenes.is_empty() {
        return Ok((0..parents.len()).filter(|&i| parents[i] == 0).collect());
    }
    let chosen = root.scene.map_or(0, |scene| scene.value());
    let scene = root.scenes.get(chosen).ok_or_else(|| format!("scene {chosen} does not exist"))?;
    if root.scenes.len() > 1 {
        notes.note(format!("scene {chosen} of {} is shown", root.scenes.len()));
    }
    Ok(scene.nodes.iter().map(Index::value).collect())
}

fn local(node: &Node, index: usize, notes: &mut Notes) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let translation = node.translation.unwrap_or_default();
    let scale = node.scale.unwrap_or([1.0; 3]);
    let [translation, scale] = [translation, scale].map(|v| DVec3::from(v.map(f64::from)));
    let rotation = rotation(node.rotation.unwrap_or_default().0).unwrap_or_else(|| {
        notes.fault(format!("node {index}: a rotation of zero length was ignored"));
        DQuat::IDENTITY
    });
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// A unit quaternion from x, y, z, w.
pub(super) fn rotation(xyzw: [f32; 4]) -> Option<DQuat> {
    let q = DQuat::from_array(xyzw.map(f64::from));
    let length = q.length();
    (length > 0.0 && length.is_finite()).then(|| q / length)
}
