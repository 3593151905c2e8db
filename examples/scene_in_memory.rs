//! Builds a scene in memory and renders it: a polished ring on a table, and the curve of light inside it.
//!
//! ```text
//! cargo run --release --example scene_in_memory
//! ```

use std::path::Path;

use nephroid::low_level::scene::shapes::CylinderCells;
use nephroid::{
    Camera, Device, DeviceOptions, Instance, Light, Material, Mesh, Result, Scene, Session, Settings, Transform,
};

/// A ring of metal, a cylinder that reflects on its inside, and a lamp beside it.
fn ring() -> Scene {
    let mut scene = Scene::default();
    let wood = scene.add_material(Material::lambert([0.7, 0.6, 0.5]));
    let gold = scene.add_material(Material::metal([0.9, 0.7, 0.4], 0.05));

    // A mesh is seen where an instance places it.
    let table = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let table = scene.add_mesh(Mesh { material: wood, ..table });
    scene.add_instance(Instance::of(table));

    let cells = CylinderCells { segments: 128, rows: 1 };
    let band = Mesh::cylinder([0.0; 3], [0.0, 0.4, 0.0], 1.0, cells);
    let band = scene.add_mesh(Mesh { material: gold, ..band });
    scene.add_instance(Instance::of(band).at(Transform::scaling([0.8; 3])).named("ring"));

    scene.add_light(Light::Point { position: [1.6, 1.2, 0.0], intensity: [12.0; 3] });
    scene.add_camera(Camera::look_at([0.0, 2.6, 1.6], [0.0; 3], [0.0, 1.0, 0.0], 0.9));
    scene
}

fn main() -> Result<()> {
    let scene = ring();
    scene.validate()?;
    let device = Device::open(&DeviceOptions::default())?;
    let mut session = Session::new(&device, scene, Settings { width: 320, height: 240, ..Settings::default() })?;
    for pass in 0..8 {
        session.run_pass(pass)?;
    }
    let file = std::env::args().nth(1).unwrap_or_else(|| "ring-in-memory.png".into());
    session.picture()?.save(Path::new(&file))?;
    println!("{file}: {} photons in {} passes", session.statistics()?.photons, session.passes().count());
    device.check_validation()
}
