//! How a scene moves: nodes with their parents, keys over time, and what hangs on them.
//!
//! A [`Motion`] stands beside the scene of a file that has animations ([`Scene::motion`]). [`Motion::pose`] says what
//! of a scene is different at a time; it is plain data, which becomes changes of a render or of the scene itself
//! ([`Pose::apply`]). What does not move has no part in it, and a scene without animations has none. The scene in its
//! pose depends on the time alone, whatever poses it had before.
//!
//! Keys are interpolated by the rules of glTF 2.0 (section 3.11 and appendix C): steps, lines with rotations along the
//! shorter arc, cubic splines whose tangents are scaled by the interval. Before its first key and after its last one a
//! property has the value of that key; nothing is repeated.

mod body;
mod lamp;
mod nodes;
mod sampler;
mod surface;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::DMat4;

pub(super) use body::{Body, Displacement, Influence, displace, vertex_matrices};
pub(super) use lamp::{
    CameraField, Lamp, LampField, MovingCamera, MovingLamp, Shape, axes, position, set_projection, spot_angles, usable,
};
pub(super) use nodes::{Local, Node, NodeField, Parts};
pub(super) use sampler::{Interpolation, Kind, Sampler};
pub(super) use surface::{
    ABSORPTION, MAX_IOR, MIRROR_IOR, MovingSurface, RADIANCE, Sources, SurfaceField, UNIT, UvTransform, absorption,
    clamped,
};

pub use body::Vertices;

use super::{
    Camera, CameraId, Instance, InstanceId, Light, LightId, Material, MaterialId, MeshId, Projection, Scene, Transform,
};

/// How a scene moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Names of all animations of the file, and whether each is played.
    animations: Vec<(String, bool)>,
    /// First and last key of what is played, in seconds.
    span: [f64; 2],
    /// What all nodes are in: the world of the file, in the unit of the scene.
    root: DMat4,
    /// Units of the scene in a unit of the file.
    unit: f64,
    /// Parents before their children.
    nodes: Vec<Node>,
    tracks: Vec<Track>,
    instances: Vec<MovingInstance>,
    shapes: Vec<MovingShape>,
    lamps: Vec<MovingLamp>,
    cameras: Vec<MovingCamera>,
    surfaces: Vec<MovingSurface>,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            animations: vec![],
            span: [0.0; 2],
            root: DMat4::IDENTITY,
            unit: 1.0,
            nodes: vec![],
            tracks: vec![],
            instances: vec![],
            shapes: vec![],
            lamps: vec![],
            cameras: vec![],
            surfaces: vec![],
        }
    }
}

/// A property of the scene that has keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Target {
    /// Of a node, by its place; while a file is read, by its index.
    Node(u32, NodeField),
    /// Of a light, by its index in the file, as those below.
    Lamp(u32, LampField),
    Camera(u32, CameraField),
    Surface(u32, SurfaceField),
}

/// Keys of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track {
    pub target: Target,
    pub sampler: Arc<Sampler>,
}

/// An instance that moves, or is shown for a time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovingInstance {
    pub instance: InstanceId,
    /// Place of its node.
    pub node: u32,
    /// What its place in the world follows from.
    pub place: Place,
}

/// Where an instance is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Place {
    /// Where its node is.
    AtNode,
    /// There, after a transform of its own (EXT_mesh_gpu_instancing).
    Within(DMat4),
    /// Where joints have its vertices: in the world.
    Bent,
}

/// A mesh whose vertices move.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovingShape {
    pub mesh: MeshId,
    /// Place of the node whose morph weights it has.
    pub node: u32,
    /// These weights at rest.
    pub weights: Vec<f32>,
    pub body: Arc<Body>,
    pub skin: Option<Arc<Skin>>,
    /// The instances that show it.
    pub instances: Vec<InstanceId>,
}

/// Joints of a skin: places of their nodes (`None` is the world itself), and what brings the mesh to each.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Skin(pub Vec<(Option<u32>, DMat4)>);

/// What is read from a file for [`Motion`], beside what it follows from.
#[derive(Debug, Default)]
pub(super) struct Moving {
    pub instances: Vec<MovingInstance>,
    pub shapes: Vec<MovingShape>,
    pub lamps: Vec<MovingLamp>,
    pub cameras: Vec<MovingCamera>,
    pub surfaces: Vec<MovingSurface>,
}

/// What of a scene is different at a time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    /// Places of instances.
    pub transforms: Vec<(InstanceId, Transform)>,
    /// Instances that are shown or hidden.
    pub visible: Vec<(InstanceId, bool)>,
    /// Vertices of meshes.
    pub vertices: Vec<(MeshId, Vertices)>,
    /// Lights; one that is hidden has no intensity.
    pub lights: Vec<(LightId, Light)>,
    /// Cameras.
    pub cameras: Vec<(CameraId, Camera)>,
    /// Materials.
    pub materials: Vec<(MaterialId, Material)>,
}

/// Everything that has keys, at a time.
struct State {
    worlds: Vec<DMat4>,
    shown: Vec<bool>,
    /// Morph weights by place of the node.
    weights: BTreeMap<u32, Vec<f32>>,
    lamps: Vec<MovingLamp>,
    cameras: Vec<MovingCamera>,
    surfaces: Vec<MovingSurface>,
}

impl Motion {
    /// What a file says, where `root` is around all its nodes.
    pub(super) fn new(
        animations: Vec<(String, bool)>,
        (root, nodes): (DMat4, Vec<Node>),
        tracks: Vec<Track>,
        moving: Moving,
    ) -> Self {
        let spans = tracks.iter().map(|track| track.sampler.span());
        let span = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_default();
        let Moving { instances, shapes, mut lamps, mut cameras, mut surfaces } = moving;
        // So that keys of one find it among many.
        lamps.sort_by_key(|lamp| lamp.of);
        cameras.sort_by_key(|camera| camera.of);
        surfaces.sort_by_key(|surface| surface.of);
        Self { animations, span, root, unit: 1.0, nodes, tracks, instances, shapes, lamps, cameras, surfaces }
    }

    /// Tells that so many units of the scene are a unit of the file.
    pub(super) fn set_unit(&mut self, unit: f64) {
        self.unit = unit;
    }

    /// All animations of the file by name, in its order, and whether each is played.
    pub fn animations(&self) -> &[(String, bool)] {
        &self.animations
    }

    /// First and last key of what is played, in seconds. Before and after, nothing moves.
    pub fn span(&self) -> [f64; 2] {
        self.span
    }

    /// Whether some surface may come to shine.
    pub(super) fn may_shine(&self) -> bool {
        let shines =
            |target| matches!(target, Target::Surface(_, SurfaceField::Emission | SurfaceField::EmissiveStrength));
        self.tracks.iter().any(|track| shines(track.target))
    }

    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.tracks.is_empty()
    }

    /// What of `scene` (the one this is the motion of, at any time) is different at `time` seconds.
    ///
    /// An instance whose place leaves no surface (it is scaled to nothing, or is not finite), or whose vertices are not
    /// finite, is hidden at that time. A camera whose node has no direction then is where it is at rest, and a light
    /// has no intensity.
    pub fn pose(&self, time: f64, scene: &Scene) -> Pose {
        let state = self.state(time);
        let mut pose = Pose::default();
        let lost = self.pose_shapes(&state, scene, &mut pose);
        for moving in &self.instances {
            self.pose_instance(moving, &state, lost.contains(&moving.instance), (scene, &mut pose));
        }
        for lamp in &state.lamps {
            let Some(former) = scene.lights.get(lamp.light.index()) else { continue };
            let light = self.light(lamp, &state);
            pose.lights.extend((light != *former).then_some((lamp.light, light)));
        }
        for camera in &state.cameras {
            let Some(former) = scene.cameras.get(camera.camera.index()) else { continue };
            let now = self.camera(camera, &state);
            pose.cameras.extend((now != *former).then_some((camera.camera, now)));
        }
        for surface in &state.surfaces {
            let now = surface.material(self.unit);
            let former = scene.materials.get(surface.material.index());
            pose.materials.extend(former.is_some_and(|m| *m != now).then_some((surface.material, now)));
        }
        pose
    }

    fn state(&self, time: f64) -> State {
        let mut nodes = self.nodes.clone();
        let mut weights = BTreeMap::new();
        let (mut lamps, mut cameras) = (self.lamps.clone(), self.cameras.clone());
        let mut surfaces = self.surfaces.clone();
        for Track { target, sampler } in &self.tracks {
            let exact = sampler.at(time);
            let value: Vec<f32> = exact.iter().map(|x| *x as f32).collect();
            match *target {
                Target::Node(place, field) => {
                    let node = &mut nodes[place as usize];
                    match field {
                        NodeField::Weights => drop(weights.insert(place, value)),
                        NodeField::Visible => node.shown = exact.first().is_some_and(|x| *x != 0.0),
                        _ => node.local.set(field, &exact),
                    }
                }
                Target::Lamp(of, field) => {
                    run(&mut lamps, of, |lamp| lamp.of).for_each(|lamp| lamp.lamp.set(field, &value));
                }
                Target::Camera(of, field) => {
                    let own = run(&mut cameras, of, |camera| camera.of);
                    own.for_each(|camera| set_projection(&mut camera.projection, field, &value));
                }
                Target::Surface(of, field) => {
                    run(&mut surfaces, of, |surface| surface.of).for_each(|surface| surface.set(field, &value));
                }
            }
        }
        State {
            worlds: nodes::worlds(self.root, &nodes),
            shown: nodes::shown(&nodes),
            weights,
            lamps,
            cameras,
            surfaces,
        }
    }

    /// Adds vertices to a pose; returns the instances whose vertices are not finite.
    fn pose_shapes(&self, state: &State, scene: &Scene, pose: &mut Pose) -> BTreeSet<InstanceId> {
        let mut lost = BTreeSet::new();
        for shape in &self.shapes {
            let Some(mesh) = scene.meshes.get(shape.mesh.index()) else { continue };
            let weights = state.weights.get(&shape.node).unwrap_or(&shape.weights);
            let joints: Option<Vec<DMat4>> = shape.skin.as_ref().map(|skin| {
                let world = |node: Option<u32>| node.map_or(DMat4::IDENTITY, |node| state.worlds[node as usize]);
                skin.0.iter().map(|(node, inverse)| world(*node) * *inverse).collect()
            });
            let now = shape.body.at(weights, joints.as_deref()).unwrap_or_else(|| {
                lost.extend(&shape.instances);
                shape.body.rest.clone()
            });
            let is_same =
                mesh.positions == now.positions && mesh.normals == now.normals && mesh.tangents == now.tangents;
            pose.vertices.extend((!is_same).then_some((shape.mesh, now)));
        }
        lost
    }

    fn pose_instance(&self, moving: &MovingInstance, state: &State, is_lost: bool, (scene, pose): (&Scene, &mut Pose)) {
        let Some(former) = scene.instances.get(moving.instance.index()) else { return };
        let world = state.worlds[moving.node as usize];
        let transform: Transform = match moving.place {
            Place::AtNode => world.into(),
            Place::Within(offset) => (world * offset).into(),
            Place::Bent => Transform::IDENTITY,
        };
        let is_valid = transform.is_valid();
        let visible = state.shown[moving.node as usize] && !is_lost && is_valid;
        let transform = if is_valid { transform } else { Transform::IDENTITY };
        let Instance { transform: place, visible: was_visible, .. } = former;
        pose.transforms.extend((*place != Some(transform)).then_some((moving.instance, transform)));
        pose.visible.extend((visible != *was_visible).then_some((moving.instance, visible)));
    }

    fn light(&self, moving: &MovingLamp, state: &State) -> Light {
        let node = moving.node as usize;
        let Ok(mut light) = moving.lamp.placed(&state.worlds[node]) else { return dark(moving.rest) };
        if let Light::Point { intensity, .. } | Light::Spot { intensity, .. } = &mut light {
            *intensity = usable(intensity.map(|x| (f64::from(x) * self.unit * self.unit) as f32));
        }
        if state.shown[node] { light } else { dark(light) }
    }

    fn camera(&self, moving: &MovingCamera, state: &State) -> Camera {
        let world = &state.worlds[moving.node as usize];
        let mut camera = moving.rest.clone();
        if let (Some([right, up, forward]), Some(position)) = (axes(world), position(world)) {
            camera = Camera { position, right, up, forward, ..camera };
        }
        let mut projection = moving.projection;
        if let Projection::Orthographic { xmag, ymag } = &mut projection {
            for half in [xmag, ymag] {
                *half = (f64::from(*half) * self.unit) as f32;
            }
        }
        let usable = |x: f32| x > 0.0 && x.is_finite();
        match projection {
            Projection::Orthographic { xmag, ymag } if !(usable(xmag) && usable(ymag)) => camera,
            _ => Camera { projection, ..camera },
        }
    }
}

/// The same light without intensity.
pub(super) fn dark(light: Light) -> Light {
    match light {
        Light::Point { position, .. } => Light::Point { position, intensity: [0.0; 3] },
        Light::Spot { position, direction, inner_angle, outer_angle, .. } => {
            Light::Spot { position, direction, intensity: [0.0; 3], inner_angle, outer_angle }
        }
        Light::Directional { direction, .. } => Light::Directional { direction, irradiance: [0.0; 3] },
    }
}

/// Those of a sorted list that are of `wanted`.
fn run<T>(sorted: &mut [T], wanted: u32, of: impl Fn(&T) -> u32) -> impl Iterator<Item = &mut T> {
    let start = sorted.partition_point(|part| of(part) < wanted);
    sorted[start..].iter_mut().take_while(move |part| of(part) == wanted)
}

impl Pose {
    /// Whether nothing is different.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Brings a scene into this pose.
    ///
    /// # Panics
    /// If the pose is of another scene.
    pub fn apply(self, scene: &mut Scene) {
        self.transforms.into_iter().for_each(|(id, t)| scene.instances[id.index()].transform = Some(t));
        self.visible.into_iter().for_each(|(id, visible)| scene.instances[id.index()].visible = visible);
        for (id, Vertices { positions, normals, tangents }) in self.vertices {
            let mesh = &mut scene.meshes[id.index()];
            (mesh.positions, mesh.normals, mesh.tangents) = (positions, normals, tangents);
        }
        self.lights.into_iter().for_each(|(id, light)| scene.lights[id.index()] = light);
        self.cameras.into_iter().for_each(|(id, camera)| scene.cameras[id.index()] = camera);
        self.materials.into_iter().for_each(|(id, material)| scene.materials[id.index()] = material);
    }
}

impl Scene {
    /// Brings the scene to where its motion has it at `time` seconds; a scene without motion stays as it is.
    pub fn move_to(&mut self, time: f64) {
        if let Some(motion) = self.motion.clone() {
            motion.pose(time, self).apply(self);
        }
    }
}
