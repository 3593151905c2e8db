//! Instances that move, are shown for a time, or whose vertices move: how they are at rest, and what they follow.

use std::sync::Arc;

use glam::DMat4;

use super::mesh::{MeshReader, Shown, Spot};
use super::nodes::Hierarchy;
use super::notes::{Notes, Outcome};
use crate::scene::flatten::handedness;
use crate::scene::motion::{Body, MovingInstance, MovingShape, NodeField, Place, Skin, Vertices, vertex_matrices};
use crate::scene::{Instance, InstanceId, Mesh, MeshId, Scene, Transform};

impl MeshReader<'_> {
    /// Whether anything of an instance changes over time.
    pub(super) fn is_moving(&mut self, shown: &Shown, spot: &Spot, hierarchy: &Hierarchy) -> bool {
        if self.animations.is_empty() {
            return false;
        }
        let life = hierarchy.placed[spot.place as usize].life;
        life.appears || life.moves && spot.skin.is_none() || self.flows(shown, spot, hierarchy)
    }

    /// Whether its vertices move.
    fn flows(&mut self, shown: &Shown, spot: &Spot, hierarchy: &Hierarchy) -> bool {
        let morphs = !shown.primitive.targets.is_empty() && self.animations.changes(spot.node, NodeField::Weights);
        morphs || spot.skin.is_some_and(|skin| self.bends(skin, hierarchy))
    }

    /// Whether a joint of a skin moves.
    fn bends(&mut self, skin: u32, hierarchy: &Hierarchy) -> bool {
        if let Some(known) = self.bends.get(&skin) {
            return *known;
        }
        let part = self.document.skins.part(skin as usize);
        let joints = part.map_or_else(|_| vec![], |part| part.indices("joints", &mut Notes::default()));
        let moves = |place: u32| hierarchy.placed[place as usize].life.moves;
        let bends = joints.into_iter().any(|joint| hierarchy.place(joint).is_some_and(moves));
        self.bends.insert(skin, bends);
        bends
    }

    /// Adds an instance as it is at rest, and keeps in mind what it follows. A mesh that is bent keeps all of its
    /// triangles and has an instance of its own: whether they have area changes.
    pub(super) fn show_moving(
        &mut self,
        shown: &mut Shown,
        spot: &Spot,
        hierarchy: &Hierarchy,
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Outcome<()> {
        let skin = spot.skin.and_then(|skin| {
            let read = self.skin(skin, hierarchy, notes).map_err(|cause| format!("skin {skin} is ignored: {cause}"));
            notes.or_lost(read)
        });
        let flows = skin.is_some() || self.flows(shown, spot, hierarchy);
        let instance = InstanceId::at(scene.instances.len());
        let (mesh, is_whole) = if flows {
            self.flowing(shown, spot, (skin.clone(), hierarchy), scene, notes)?
        } else {
            (self.solid(shown, spot, scene, notes)?, true)
        };
        let place = match (&skin, &spot.offset) {
            (Some(_), _) => Place::Bent,
            (None, Some(offset)) => Place::Within(**offset),
            (None, None) => Place::AtNode,
        };
        let transform = if skin.is_some() { Transform::IDENTITY } else { spot.to_world.into() };
        let is_valid = transform.is_valid();
        let transform = if is_valid { transform } else { Transform::IDENTITY };
        let visible = hierarchy.placed[spot.place as usize].life.visible && is_whole && is_valid;
        scene.add_instance(Instance { name: spot.name.clone(), mesh, transform: Some(transform), visible });
        self.moving.instances.push(MovingInstance { instance, node: spot.place, place });
        if flows && let Some(shape) = self.moving.shapes.iter_mut().rfind(|shape| shape.mesh == mesh) {
            shape.instances.push(instance);
        }
        Ok(())
    }

    /// The mesh of an instance whose vertices stay where they are in it.
    fn solid(&self, shown: &mut Shown, spot: &Spot, scene: &mut Scene, notes: &mut Notes) -> Outcome<MeshId> {
        if let Some((_, mesh)) = shown.own.filter(|(owner, _)| *owner == spot.node) {
            return Ok(mesh);
        }
        let shape = self.shape(shown, spot, notes)?;
        if matches!(shape, std::borrow::Cow::Borrowed(_)) {
            let plain = match shown.plain {
                Some(plain) => plain,
                None => self.add(scene, shape.into_owned())?,
            };
            shown.plain = Some(plain);
            return Ok(plain);
        }
        let mesh = self.add(scene, shape.into_owned())?;
        shown.own = Some((spot.node, mesh));
        Ok(mesh)
    }

    /// The mesh of a node whose vertices move, and whether it can be shown at rest.
    fn flowing(
        &mut self,
        shown: &mut Shown,
        spot: &Spot,
        (skin, hierarchy): (Option<Arc<Skin>>, &Hierarchy),
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Outcome<(MeshId, bool)> {
        if let Some((_, mesh)) = shown.own.filter(|(owner, _)| *owner == spot.node) {
            return Ok((mesh, true));
        }
        let body = match &shown.body {
            Some(body) => body.clone(),
            None => Arc::new(self.body(shown, notes)?),
        };
        shown.body = Some(body.clone());
        let weights = self.weights(shown, spot.node, notes)?;
        let joints: Option<Vec<DMat4>> = skin.as_ref().map(|skin| {
            let world = |place: Option<u32>| place.map(|place| hierarchy.placed[place as usize].to_world);
            skin.0.iter().map(|(place, inverse)| world(*place).unwrap_or_default() * *inverse).collect()
        });
        let at_rest = body.at(&weights, joints.as_deref());
        let is_whole = at_rest.is_some();
        let Vertices { positions, normals, tangents } = at_rest.unwrap_or_else(|| body.rest.clone());
        let mut mesh = Mesh { positions, normals, tangents, ..shown.primitive.mesh.clone() };
        if let Some(joints) = &joints {
            turn_mirrored(&mut mesh, &vertex_matrices(&body.influences, body.rest.positions.len(), joints));
        }
        let mesh = self.add(scene, mesh)?;
        shown.own = Some((spot.node, mesh));
        self.moving.shapes.push(MovingShape { mesh, node: spot.place, weights, body, skin, instances: vec![] });
        Ok((mesh, is_whole))
    }

    /// A primitive with all that may move its vertices.
    fn body(&self, shown: &Shown, notes: &mut Notes) -> Outcome<Body> {
        let Mesh { positions, normals, tangents, .. } = &shown.primitive.mesh;
        let bytes = 12 * positions.len() + 12 * normals.len() + 16 * tangents.len();
        self.document.buffers.charge(bytes as u64)?;
        let rest = Vertices { positions: positions.clone(), normals: normals.clone(), tangents: tangents.clone() };
        let targets = shown.primitive.targets.iter();
        let targets = targets.map(|target| self.displacement(shown.primitive, target, notes)).collect();
        Ok(Body { rest, targets, influences: shown.primitive.influences.clone() })
    }

    /// The joints of a skin by their places in the hierarchy.
    fn skin(&mut self, skin: u32, hierarchy: &Hierarchy, notes: &mut Notes) -> Outcome<Arc<Skin>> {
        if let Some(known) = self.skins.get(&skin) {
            return Ok(known.clone());
        }
        let joint = |(node, inverse)| match hierarchy.to_world(node) {
            Some(_) => Ok((hierarchy.place(node), inverse)),
            None => Err(format!("node {node} does not exist")),
        };
        let joints = self.bound(skin, notes)?.into_iter().map(joint).collect::<Outcome<Vec<_>>>()?;
        let read = Arc::new(Skin(joints));
        self.skins.insert(skin, read.clone());
        Ok(read)
    }
}

/// Keeps the front of triangles that joints mirror at rest; joints that come to mirror them later turn them over.
fn turn_mirrored(mesh: &mut Mesh, matrices: &[DMat4]) {
    for triangle in &mut mesh.triangles {
        if handedness(&matrices[triangle[0] as usize]) < 0.0 {
            triangle.swap(1, 2);
        }
    }
}
