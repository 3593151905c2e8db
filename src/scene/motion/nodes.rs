//! The hierarchy of nodes: where each is, and whether it is shown.

use glam::{DMat4, DQuat, DVec3};

/// A node of the scene.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) struct Node {
    /// The place of its parent, which is before its own; `None` for a root.
    pub parent: Option<u32>,
    /// To its parent, where nothing moves it.
    pub local: Local,
    /// Whether it is shown by itself, where nothing changes that.
    pub shown: bool,
}

/// From a node to its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum Local {
    Matrix(DMat4),
    /// Scaled, then turned, then moved.
    Parts(Parts),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct Parts {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
}

/// A property of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum NodeField {
    Translation,
    Rotation,
    Scale,
    /// Morph weights of its mesh.
    Weights,
    /// Whether it is shown, with all below it (KHR_node_visibility).
    Visible,
}

impl Local {
    pub fn matrix(&self) -> DMat4 {
        match self {
            Self::Matrix(matrix) => *matrix,
            Self::Parts(Parts { translation, rotation, scale }) => {
                DMat4::from_scale_rotation_translation(*scale, *rotation, *translation)
            }
        }
    }

    /// Moves, turns or scales the node; other properties are none of its place. A matrix is taken apart: it had shear
    /// in no file that the standard allows to be animated.
    pub fn set(&mut self, field: NodeField, value: &[f64]) {
        let mut parts = match *self {
            Self::Parts(parts) => parts,
            Self::Matrix(matrix) => {
                let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
                Parts { translation, rotation, scale }
            }
        };
        match (field, value) {
            (NodeField::Translation, [x, y, z]) => parts.translation = DVec3::new(*x, *y, *z),
            (NodeField::Scale, [x, y, z]) => parts.scale = DVec3::new(*x, *y, *z),
            // A rotation without a direction turns nothing.
            (NodeField::Rotation, [0.0, 0.0, 0.0, 0.0]) => parts.rotation = DQuat::IDENTITY,
            (NodeField::Rotation, [x, y, z, w]) => parts.rotation = DQuat::from_xyzw(*x, *y, *z, *w),
            _ => return,
        }
        *self = Self::Parts(parts);
    }
}

/// Local to world of every node, with `root` after all of it.
pub(super) fn worlds(root: DMat4, nodes: &[Node]) -> Vec<DMat4> {
    let mut worlds: Vec<DMat4> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let parent = node.parent.map_or(root, |parent| worlds[parent as usize]);
        worlds.push(parent * node.local.matrix());
    }
    worlds
}

/// Whether each node and all above it are shown.
pub(super) fn shown(nodes: &[Node]) -> Vec<bool> {
    let mut shown: Vec<bool> = Vec::with_capacity(nodes.len());
    for node in nodes {
        shown.push(node.shown && node.parent.is_none_or(|parent| shown[parent as usize]));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_set_one_by_one() {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let whole = DMat4::from_scale_rotation_translation(DVec3::splat(2.0), quarter, DVec3::X);
        let mut local = Local::Matrix(whole);
        local.set(NodeField::Weights, &[1.0]);
        assert_eq!(local, Local::Matrix(whole), "weights move no node");
        local.set(NodeField::Translation, &[0.0, 0.0, 5.0]);
        assert!(local.matrix().transform_point3(DVec3::X).distance(DVec3::new(0.0, 2.0, 5.0)) < 1e-12);
        local.set(NodeField::Rotation, &[0.0; 4]);
        local.set(NodeField::Scale, &[3.0, -1.0, 0.0]);
        assert_eq!(local.matrix().transform_point3(DVec3::ONE), DVec3::new(3.0, -1.0, 5.0));
    }

    #[test]
    fn children_follow_and_hide_with_their_parents() {
        let node = |parent, x, shown| {
            let local = Local::Matrix(DMat4::from_translation(DVec3::new(x, 0.0, 0.0)));
            Node { parent, local, shown }
        };
        let nodes = [node(None, 1.0, true), node(Some(0), 2.0, false), node(Some(1), 4.0, true), node(None, 8.0, true)];
        let x: Vec<f64> =
            worlds(DMat4::from_scale(DVec3::splat(10.0)), &nodes).iter().map(|world| world.w_axis.x).collect();
        assert_eq!(x, [10.0, 30.0, 70.0, 80.0]);
        assert_eq!(shown(&nodes), [true, false, false, true]);
    }
}
