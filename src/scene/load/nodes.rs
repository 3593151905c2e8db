//! The node hierarchy: world transforms of everything that is placed in the scene.

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::Limits;
use super::animation::Animations;
use super::document::Document;
use super::notes::{Notes, Outcome};
use super::part::Part;
use crate::scene::motion::{Local, Node, NodeField, Parts};

/// A node of the chosen scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    /// Index of the node in the file.
    pub node: u32,
    /// Local to world.
    pub to_world: DMat4,
    pub holds: Holds,
    pub life: Life,
}

/// What becomes of a node over time, with all above it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Life {
    /// Whether it is shown at rest.
    pub visible: bool,
    /// Whether this changes.
    pub appears: bool,
    /// Whether it is moved, turned or scaled.
    pub moves: bool,
}

/// What a node places, by index in the lists of the file.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Holds {
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    pub light: Option<u32>,
}

/// The nodes of the chosen scene in depth-first order, children in the order they are listed.
pub(super) struct Hierarchy {
    pub placed: Vec<Placed>,
    /// For each node of the file its place in `placed`, or [`ABSENT`].
    places: Vec<u32>,
    /// The same nodes as parents and children, where anything moves.
    pub nodes: Vec<Node>,
}

const ABSENT: u32 = u32::MAX;

impl Hierarchy {
    /// Local to world of any node, identity outside of the chosen scene; `None` if there is no such node. Joints may be
    /// any of them.
    pub fn to_world(&self, node: u32) -> Option<DMat4> {
        let place = *self.places.get(node as usize)?;
        Some(self.placed.get(place as usize).map_or(DMat4::IDENTITY, |placed| placed.to_world))
    }

    /// The place of a node in `placed`, if it is in the chosen scene.
    pub fn place(&self, node: u32) -> Option<u32> {
        self.places.get(node as usize).copied().filter(|place| *place != ABSENT)
    }
}

/// A node that is still to be visited.
struct Waiting {
    node: u32,
    parent: DMat4,
    /// Its place.
    above: Option<u32>,
    depth: u32,
    life: Life,
}

/// Walks the default scene (or the first, or all root nodes where the file has no scenes). A node that is listed twice
/// is placed once. `start` is a map of the whole world. Fails on hierarchies deeper than the limit.
pub(super) fn walk(
    (document, animations): (&Document, &Animations),
    start: DMat4,
    limits: &Limits,
    notes: &mut Notes,
) -> Outcome<Hierarchy> {
    let mut walk = Walk { document, animations, hidden: 0, stack: Vec::new(), hierarchy: Hierarchy::empty(document) };
    let roots = scene_roots(document, notes);
    let has_parent = children(document);
    let (inner, outer): (Vec<u32>, Vec<u32>) =
        roots.iter().partition(|root| has_parent.get(**root as usize).is_some_and(|known| *known));
    // A root that is also below another node of the scene is placed where that node has it.
    for root in outer.into_iter().chain(inner) {
        if walk.is_placed(root) {
            notes.fault(format!("node {root} is listed twice; it is shown once"));
            continue;
        }
        let life = Life { visible: true, appears: false, moves: false };
        walk.stack.push(Waiting { node: root, parent: start, above: None, depth: 0, life });
        while let Some(waiting) = walk.stack.pop() {
            if waiting.depth > limits.depth {
                let levels = limits.depth;
                return Err(format!("node {} is nested deeper than the limit of {levels} levels", waiting.node));
            }
            let visited = walk.visit(&waiting, notes);
            notes.or_lost(visited);
        }
    }
    if walk.hidden > 0 {
        notes.note(format!("{} node(s) are hidden and left out", walk.hidden));
    }
    Ok(walk.hierarchy)
}

struct Walk<'a> {
    document: &'a Document<'a>,
    animations: &'a Animations,
    hierarchy: Hierarchy,
    stack: Vec<Waiting>,
    /// Nodes with a mesh or a light that are not shown.
    hidden: u64,
}

impl Hierarchy {
    fn empty(document: &Document) -> Self {
        Self { placed: Vec::new(), places: vec![ABSENT; document.nodes.len()], nodes: Vec::new() }
    }
}

impl Walk<'_> {
    fn is_placed(&self, node: u32) -> bool {
        self.hierarchy.places.get(node as usize).is_some_and(|place| *place != ABSENT)
    }

    /// Places a node and lists its children.
    fn visit(&mut self, waiting: &Waiting, notes: &mut Notes) -> Outcome<()> {
        let node = waiting.node;
        let part = self.document.nodes.part(node as usize)?;
        if self.is_placed(node) {
            return Err(format!("node {node} is listed twice; it is shown once"));
        }
        let local = local(&part, notes);
        let to_world = waiting.parent * local.matrix();
        if !to_world.is_finite() {
            notes.fault(format!("node {node}: its transform is not finite; it was skipped with all below it"));
            return Ok(());
        }
        let visibility = part.extension("KHR_node_visibility", notes);
        let shown = visibility.and_then(|part| part.flag("visible", notes)).unwrap_or(true);
        let life = Life {
            visible: waiting.life.visible && shown,
            appears: waiting.life.appears || self.animations.changes(node, NodeField::Visible),
            moves: waiting.life.moves || self.animations.moves(node),
        };
        let mut holds = Holds::of(&part, notes);
        if !life.visible && !life.appears && (holds.mesh.is_some() || holds.light.is_some()) {
            self.hidden += 1;
            holds = Holds { mesh: None, light: None, ..holds };
        }
        let place = self.hierarchy.placed.len() as u32;
        self.hierarchy.places[node as usize] = place;
        self.hierarchy.placed.push(Placed { node, to_world, holds, life });
        if !self.animations.is_empty() {
            self.hierarchy.nodes.push(Node { parent: waiting.above, local, shown });
        }
        let depth = waiting.depth + 1;
        for child in part.indices("children", notes).into_iter().rev() {
            self.stack.push(Waiting { node: child, parent: to_world, above: Some(place), depth, life });
        }
        Ok(())
    }
}

impl Holds {
    fn of(part: &Part, notes: &mut Notes) -> Self {
        let mut index = |name: &str| notes.or_lost(part.index(name)).flatten();
        let [mesh, skin, camera] = ["mesh", "skin", "camera"].map(&mut index);
        let light = part.extension("KHR_lights_punctual", notes);
        let light = light.and_then(|light| notes.or_fault(light.index("light")).flatten());
        Self { mesh, skin, camera, light }
    }
}

fn scene_roots(document: &Document, notes: &mut Notes) -> Vec<u32> {
    let scenes = document.scenes.len();
    if scenes == 0 {
        let is_child = children(document);
        return (0..is_child.len() as u32).filter(|i| !is_child[*i as usize]).collect();
    }
    let mut chosen = document.scene.unwrap_or(0) as usize;
    if chosen >= scenes {
        notes.fault(format!("scene {chosen} does not exist; scene 0 is shown"));
        chosen = 0;
    }
    if scenes > 1 {
        notes.note(format!("scene {chosen} of {scenes} is shown"));
    }
    let scene = notes.or_lost(document.scenes.part(chosen));
    scene.map_or(Vec::new(), |scene| scene.indices("nodes", notes))
}

/// For each node whether it is the child of another.
fn children(document: &Document) -> Vec<bool> {
    let quiet = &mut Notes::default();
    let mut is_child = vec![false; document.nodes.len()];
    for part in (0..document.nodes.len()).filter_map(|i| document.nodes.part(i).ok()) {
        for child in part.indices("children", quiet) {
            if let Some(known) = is_child.get_mut(child as usize) {
                *known = true;
            }
        }
    }
    is_child
}

fn local(part: &Part, notes: &mut Notes) -> Local {
    if let Some(matrix) = part.numbers::<16>("matrix", notes) {
        let mut matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        let last_row = DVec4::W;
        if matrix.row(3) != last_row && matrix.is_finite() {
            notes.fault(format!("{}: the last row of its matrix is not 0, 0, 0, 1 and was ignored", part.place));
            matrix = DMat4::from_cols_array_2d(&std::array::from_fn(|c| {
                let [x, y, z, _] = matrix.col(c).to_array();
                [x, y, z, last_row[c]]
            }));
        }
        return Local::Matrix(matrix);
    }
    let translation = part.numbers("translation", notes).unwrap_or([0.0; 3]);
    let scale = part.numbers("scale", notes).unwrap_or([1.0; 3]);
    let [translation, scale] = [translation, scale].map(|v| DVec3::from(v.map(f64::from)));
    let quaternion = part.numbers("rotation", notes).unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = rotation(quaternion).unwrap_or_else(|| {
        notes.fault(format!("{}: a rotation of zero length was ignored", part.place));
        DQuat::IDENTITY
    });
    Local::Parts(Parts { translation, rotation, scale })
}

/// A unit quaternion from x, y, z, w.
pub(super) fn rotation(xyzw: [f32; 4]) -> Option<DQuat> {
    let q = DQuat::from_array(xyzw.map(f64::from));
    let length = q.length();
    (length > 0.0 && length.is_finite()).then(|| q / length)
}
