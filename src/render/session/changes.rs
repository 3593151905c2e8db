//! What may change in a scene that is being rendered, and what each change makes stale.

use std::fmt;

use crate::render::scene::host::triangle_flags;
use crate::render::scene::upload::Stale;
use crate::render::settings::{Lens, Settings, Shutter};
use crate::scene::{
    Camera, CameraId, InstanceId, Light, LightId, Material, MaterialId, MeshId, Scene, TextureRef, Transform,
};

/// A step of preparing a render that a change may ask for anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Step {
    /// The film is cleared, and statistics start again.
    Film,
    /// The camera and its lens are written.
    Camera,
    /// The table of lights is computed and written.
    Lights,
    /// Spheres that caustic photons are aimed at are found.
    Casters,
    /// Materials are written.
    Materials,
    /// Vertex attributes are written.
    Vertices,
    /// The scene is flattened and a tree is built over its triangles.
    Tree,
    /// A pass is planned and recorded.
    Plan,
}

impl Step {
    const ALL: [Self; 8] = [
        Self::Film,
        Self::Camera,
        Self::Lights,
        Self::Casters,
        Self::Materials,
        Self::Vertices,
        Self::Tree,
        Self::Plan,
    ];
}

/// A set of [`Step`]s.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub struct Steps(u8);

impl Steps {
    /// The set of these steps.
    pub fn of(steps: impl IntoIterator<Item = Step>) -> Self {
        steps.into_iter().fold(Self::default(), |set, step| Self(set.0 | 1 << step as u8))
    }

    /// Whether a step is in the set.
    pub fn has(self, step: Step) -> bool {
        self.0 & 1 << step as u8 != 0
    }

    /// Whether there is no step.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The steps of both sets.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The steps in order.
    pub fn iter(self) -> impl Iterator<Item = Step> {
        Step::ALL.into_iter().filter(move |step| self.has(*step))
    }
}

impl fmt::Debug for Steps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

/// One change of a scene or of its view. Nothing else of the scene changes with it.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Another place, direction or projection of a camera.
    Camera(CameraId, Camera),
    /// Another camera of the scene.
    View(CameraId),
    /// Another lens, or a pinhole.
    Lens(Option<Lens>),
    /// Another seed of all random numbers.
    Seed(u32),
    /// Another time that the shutter is open. The scene stays as it is until the next pass: [`super::Session::show`]
    /// brings it along.
    Shutter(Option<Shutter>),
    /// Another light in the place of one.
    Light(LightId, Light),
    /// Another place of an instance, see [`crate::scene::Instance::transform`].
    Transform(InstanceId, Option<Transform>),
    /// An instance is shown or hidden.
    Visible(InstanceId, bool),
    /// Another material in the place of one.
    Material(MaterialId, Box<Material>),
    /// Other positions and normals of a mesh, as many as before; no normals leave its triangles flat.
    Vertices(MeshId, Vec<[f32; 3]>, Vec<[f32; 3]>),
    /// Other tangents of a mesh, as many as before.
    Tangents(MeshId, Vec<[f32; 4]>),
}

impl Change {
    /// What the change may ask for. A plan is made anew only where what the kernels have to do has changed, or a buffer
    /// is too short: [`super::Session::update`] tells.
    pub fn invalidates(&self) -> Steps {
        use Step::{Camera, Casters, Film, Lights, Materials, Plan, Tree, Vertices};
        match self {
            Self::Camera(..) | Self::View(_) => Steps::of([Film, Camera]),
            Self::Lens(_) => Steps::of([Film, Camera, Plan]),
            Self::Seed(_) | Self::Shutter(_) => Steps::of([Film]),
            Self::Light(..) => Steps::of([Film, Lights, Materials, Plan]),
            Self::Material(..) => Steps::of([Film, Lights, Casters, Materials, Vertices, Tree, Plan]),
            Self::Transform(..) | Self::Visible(..) | Self::Vertices(..) | Self::Tangents(..) => {
                Steps::of([Film, Lights, Casters, Materials, Vertices, Tree, Plan])
            }
        }
    }

    /// Why the change cannot be made, if it cannot.
    pub(super) fn fault(&self, scene: &Scene) -> Option<String> {
        let known = |kind: &str, index: usize, count: usize| {
            if index < count { Ok(()) } else { Err(format!("there is no {kind} {index}, the scene has {count}")) }
        };
        let checked = match self {
            Self::Camera(id, camera) => known("camera", id.index(), scene.cameras.len()).and_then(|()| camera.check()),
            Self::View(id) => known("camera", id.index(), scene.cameras.len()),
            Self::Lens(_) | Self::Seed(_) | Self::Shutter(_) => Ok(()),
            Self::Light(id, light) => known("light", id.index(), scene.lights.len()).and_then(|()| light.check()),
            Self::Transform(id, transform) => known("instance", id.index(), scene.instances.len())
                .and_then(|()| transform.as_ref().map_or(Ok(()), Transform::check)),
            Self::Visible(id, _) => known("instance", id.index(), scene.instances.len()),
            Self::Material(id, material) => {
                known("material", id.index(), scene.materials.len()).and_then(|()| material.check(scene.textures.len()))
            }
            Self::Vertices(id, positions, normals) => known("mesh", id.index(), scene.meshes.len())
                .and_then(|()| scene.meshes[id.index()].check_vertices(positions, normals)),
            Self::Tangents(id, tangents) => known("mesh", id.index(), scene.meshes.len())
                .and_then(|()| scene.meshes[id.index()].check_tangents(tangents)),
        };
        checked.err()
    }

    /// Exchanges what the scene or the settings have with what the change has: done twice, nothing has happened.
    pub(super) fn exchange(&mut self, scene: &mut Scene, settings: &mut Settings) {
        use std::mem::swap;
        match self {
            Self::Camera(id, camera) => swap(&mut scene.cameras[id.index()], camera),
            Self::View(id) => {
                let former = CameraId::at(settings.camera);
                settings.camera = std::mem::replace(id, former).index();
            }
            Self::Lens(lens) => swap(&mut settings.lens, lens),
            Self::Seed(seed) => swap(&mut settings.seed, seed),
            Self::Shutter(shutter) => swap(&mut settings.shutter, shutter),
            Self::Light(id, light) => swap(&mut scene.lights[id.index()], light),
            Self::Transform(id, transform) => swap(&mut scene.instances[id.index()].transform, transform),
            Self::Visible(id, visible) => swap(&mut scene.instances[id.index()].visible, visible),
            Self::Material(id, material) => swap(&mut scene.materials[id.index()], &mut **material),
            Self::Vertices(id, positions, normals) => {
                let mesh = &mut scene.meshes[id.index()];
                swap(&mut mesh.positions, positions);
                swap(&mut mesh.normals, normals);
            }
            Self::Tangents(id, tangents) => swap(&mut scene.meshes[id.index()].tangents, tangents),
        }
    }

    /// What is stale once the change was made, this being what was there before; nothing where nothing differs.
    pub(super) fn stale(&self, scene: &Scene, settings: &Settings) -> Effect {
        let view = Effect { film: true, camera: true, ..Effect::default() };
        let changes = |changed: bool, effect: Effect| if changed { effect } else { Effect::default() };
        let shown = |id: &InstanceId| scene.instances[id.index()].visible;
        match self {
            Self::Camera(id, camera) => {
                changes(id.index() == settings.camera && scene.cameras[id.index()] != *camera, view)
            }
            Self::View(id) => changes(id.index() != settings.camera, view),
            Self::Lens(lens) => changes(settings.lens != *lens, view),
            Self::Seed(seed) => changes(settings.seed != *seed, Effect { film: true, leaf: true, ..Effect::default() }),
            Self::Shutter(shutter) => {
                let moves = scene.motion.as_ref().is_some_and(|motion| !motion.is_still());
                changes(moves && settings.shutter != *shutter, Effect { film: true, leaf: true, ..Effect::default() })
            }
            Self::Light(id, light) => changes(scene.lights[id.index()] != *light, Effect::of(Stale::default())),
            Self::Transform(id, transform) => {
                changes(shown(id) && scene.instances[id.index()].transform != *transform, Effect::moved(vec![*id]))
            }
            Self::Visible(id, visible) => {
                changes(shown(id) != *visible, Effect::of(Stale { geometry: true, casters: true, ..Stale::default() }))
            }
            Self::Material(id, former) => {
                let now = &scene.materials[id.index()];
                changes(now != &**former, Effect::of(stale_materials(former, now)))
            }
            Self::Vertices(id, positions, normals) => {
                let (mesh, moved) = (&scene.meshes[id.index()], shown_instances(scene, *id));
                let differs = mesh.positions != *positions || mesh.normals != *normals;
                changes(differs && !moved.is_empty(), Effect::moved(moved))
            }
            Self::Tangents(id, tangents) => {
                let moved = shown_instances(scene, *id);
                changes(scene.meshes[id.index()].tangents != *tangents && !moved.is_empty(), Effect::moved(moved))
            }
        }
    }
}

/// The visible instances of a mesh.
fn shown_instances(scene: &Scene, mesh: MeshId) -> Vec<InstanceId> {
    let shows = |i: &usize| scene.instances[*i].visible && scene.instances[*i].mesh == mesh;
    (0..scene.instances.len()).filter(shows).map(InstanceId::at).collect()
}

/// What a material asks for that became another.
fn stale_materials(former: &Material, now: &Material) -> Stale {
    let refs = |m: &Material| m.texture_refs().copied().collect::<Vec<TextureRef>>();
    let textures = refs(former) != refs(now) || former.normal_texture != now.normal_texture;
    Stale {
        // Texture coordinates and tangents of the world are those that materials ask for.
        geometry: textures,
        moved: vec![],
        masks: triangle_flags(former) != triangle_flags(now),
        materials: true,
        textures,
        casters: true,
        sky: false,
    }
}

/// What a change makes stale.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Effect {
    pub film: bool,
    pub camera: bool,
    /// The scene on the device, and what of it beside the lights.
    pub scene: Option<Stale>,
    /// How many photons a leaf of their tree holds.
    pub leaf: bool,
}

impl Effect {
    /// A change of the scene.
    pub(super) fn of(stale: Stale) -> Self {
        Self { film: true, camera: false, scene: Some(stale), leaf: true }
    }

    /// Instances that are elsewhere, or their vertices.
    fn moved(moved: Vec<InstanceId>) -> Self {
        Self::of(Stale { moved, ..Stale::default() })
    }

    /// What either makes stale.
    pub fn and(self, other: Self) -> Self {
        let scene = match (self.scene, other.scene) {
            (Some(a), Some(b)) => Some(a.and(b)),
            (a, b) => a.or(b),
        };
        Self {
            film: self.film || other.film,
            camera: self.camera || other.camera,
            scene,
            leaf: self.leaf || other.leaf,
        }
    }
}

/// Changes that are made together, in order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes(pub Vec<Change>);

impl Changes {
    /// No change.
    pub fn new() -> Self {
        Self::default()
    }

    /// These changes and one more.
    pub fn with(mut self, change: Change) -> Self {
        self.0.push(change);
        self
    }

    /// What the changes may ask for, see [`Change::invalidates`].
    pub fn invalidates(&self) -> Steps {
        self.0.iter().fold(Steps::default(), |steps, change| steps.and(change.invalidates()))
    }

    /// Another place, direction or projection of a camera.
    pub fn camera(self, id: CameraId, camera: Camera) -> Self {
        self.with(Change::Camera(id, camera))
    }

    /// Another light in the place of one.
    pub fn light(self, id: LightId, light: Light) -> Self {
        self.with(Change::Light(id, light))
    }

    /// Another place of an instance.
    pub fn transform(self, id: InstanceId, transform: Transform) -> Self {
        self.with(Change::Transform(id, Some(transform)))
    }

    /// An instance is shown or hidden.
    pub fn visible(self, id: InstanceId, visible: bool) -> Self {
        self.with(Change::Visible(id, visible))
    }

    /// Another material in the place of one.
    pub fn material(self, id: MaterialId, material: Material) -> Self {
        self.with(Change::Material(id, Box::new(material)))
    }
}
