//! What changes of a scene cost in a running session, beside a new session.

use std::sync::Arc;
use std::time::Instant;

use super::median;
use crate::error::Result;
use crate::render::{Change, Changes, Session, Settings, Steps};
use crate::scene::{CameraId, InstanceId, Light, LightId, Material, MaterialId, Mesh, MeshId, Scene, Transform};
use crate::vk::Device;

/// What was measured on a scene.
#[derive(Debug, Clone)]
pub struct UpdateReport {
    /// Its file, or what it is.
    pub name: String,
    /// Triangles in the tree.
    pub triangles: u32,
    /// Seconds to open a session on a device that has compiled nothing yet.
    pub fresh: f64,
    /// Seconds to open a session on a device that has compiled all kernels.
    pub warm: f64,
    /// Each kind of change that the scene allows.
    pub rows: Vec<UpdateRow>,
}

/// The cost of one kind of change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateRow {
    /// The change.
    pub name: &'static str,
    /// Seconds of the update.
    pub update: f64,
    /// Seconds of what the update leaves to the next pass: an empty film.
    pub prepare: f64,
    /// What the update did.
    pub steps: Steps,
}

/// A change and its way back.
struct Kind {
    name: &'static str,
    there: Change,
    back: Change,
}

/// Measures on `scene`, on devices opened by `open`: the medians of `repeats` runs. `begin` hears what comes next.
///
/// # Errors
/// Those of the devices.
pub fn update(
    open: &dyn Fn() -> Result<Arc<Device>>,
    (scene, settings): (&Scene, &Settings),
    repeats: u32,
    begin: &mut dyn FnMut(&str),
) -> Result<UpdateReport> {
    let scene = &with_lamp(scene);
    begin("a new session");
    let timed = |device: &Arc<Device>| -> Result<(Session, f64)> {
        let (scene, settings) = (scene.clone(), settings.clone());
        let start = Instant::now();
        let session = Session::new(device, scene, settings)?;
        Ok((session, start.elapsed().as_secs_f64()))
    };
    let repeats = repeats.max(1);
    let fresh: Result<Vec<f64>> = (0..repeats.min(5)).map(|_| Ok(timed(&open()?)?.1)).collect();
    let device = open()?;
    let mut session = timed(&device)?.0;
    let warm: Result<Vec<f64>> = (0..repeats).map(|_| Ok(timed(&device)?.1)).collect();
    let mut rows = Vec::new();
    for kind in kinds(scene) {
        begin(kind.name);
        rows.push(row(&mut session, &kind, repeats)?);
    }
    Ok(UpdateReport {
        name: scene.path.display().to_string(),
        triangles: session.device_scene().triangle_count,
        fresh: median(fresh?),
        warm: median(warm?),
        rows,
    })
}

/// The scene, with a faint lamp at its first camera if it has no light of that kind.
fn with_lamp(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if scene.lights.is_empty() {
        let position = scene.cameras.first().map_or([0.0; 3], |camera| camera.position);
        scene.add_light(Light::Point { position, intensity: [1e-3; 3] });
    }
    scene
}

/// There and back until each way was gone often enough; the first time there does not count.
fn row(session: &mut Session, Kind { name, there, back }: &Kind, repeats: u32) -> Result<UpdateRow> {
    session.run_pass(0)?;
    let (mut updates, mut prepares, mut steps) = (Vec::new(), Vec::new(), Steps::default());
    for run in 0..=repeats {
        for change in [there, back] {
            let changes = Changes::new().with(change.clone());
            let start = Instant::now();
            let updated = session.update(changes)?;
            let update = start.elapsed().as_secs_f64();
            let start = Instant::now();
            session.prepare()?;
            if run > 0 {
                updates.push(update);
                prepares.push(start.elapsed().as_secs_f64());
            }
            steps = steps.and(updated.steps);
        }
    }
    Ok(UpdateRow { name, update: median(updates), prepare: median(prepares), steps })
}

/// One change of each kind that the scene allows.
fn kinds(scene: &Scene) -> Vec<Kind> {
    let mut kinds = Vec::new();
    if let Some(camera) = scene.cameras.first() {
        let mut moved = camera.clone();
        moved.position[1] += 1e-3 * (1.0 + moved.position[1].abs());
        let change = |camera| Change::Camera(CameraId(0), camera);
        kinds.push(Kind { name: "camera", there: change(moved), back: change(camera.clone()) });
    }
    kinds.push(Kind { name: "seed", there: Change::Seed(1), back: Change::Seed(0) });
    if let Some(light) = scene.lights.first() {
        let change = |light| Change::Light(LightId(0), light);
        kinds.push(Kind { name: "light moved", there: change(moved_light(*light)), back: change(*light) });
        kinds.push(Kind { name: "light dimmed", there: change(dimmed(*light)), back: change(*light) });
    }
    if let Some(material) = scene.materials.first() {
        let mut other = material.clone();
        other.base_color[0] = 0.9 * other.base_color[0] + 0.01;
        let change = |material: Material| Change::Material(MaterialId(0), Box::new(material));
        kinds.push(Kind { name: "material colour", there: change(other), back: change(material.clone()) });
    }
    kinds.extend(geometry(scene));
    kinds
}

/// Changes of the last instance and of its mesh.
fn geometry(scene: &Scene) -> Vec<Kind> {
    let Some(instance) = scene.instances.last() else { return vec![] };
    let id = InstanceId::at(scene.instances.len() - 1);
    let shift = Transform::translation([0.0, 1e-3, 0.0]);
    let moved = instance.transform.unwrap_or_default().then(shift);
    let place = |transform| Change::Transform(id, transform);
    let visible = |visible| Change::Visible(id, visible);
    let Mesh { positions, normals, .. } = &scene.meshes[instance.mesh.index()];
    let grown: Vec<[f32; 3]> = positions.iter().map(|p| p.map(|x| 1.001 * x)).collect();
    let vertices = |positions: &[[f32; 3]]| vertices(instance.mesh, positions, normals);
    vec![
        Kind { name: "instance moved", there: place(Some(moved)), back: place(instance.transform) },
        Kind { name: "instance hidden, shown", there: visible(false), back: visible(true) },
        Kind { name: "vertices of a mesh", there: vertices(&grown), back: vertices(positions) },
    ]
}

fn vertices(mesh: MeshId, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Change {
    Change::Vertices(mesh, positions.to_vec(), normals.to_vec())
}

fn moved_light(mut light: Light) -> Light {
    match &mut light {
        Light::Point { position, .. } | Light::Spot { position, .. } => position[0] += 1e-3,
        Light::Directional { direction, .. } => *direction = [direction[2], direction[1], -direction[0]],
    }
    light
}

/// A little less of it: the film counts in the same units.
fn dimmed(mut light: Light) -> Light {
    match &mut light {
        Light::Point { intensity: x, .. }
        | Light::Spot { intensity: x, .. }
        | Light::Directional { irradiance: x, .. } => {
            *x = x.map(|x| 0.999 * x);
        }
    }
    light
}
