//! Renders a scene, moves the camera and a lamp, and renders again: nothing is loaded, built or planned anew.
//!
//! ```text
//! cargo run --release --example moving_camera -- moving_camera.png
//! ```

use std::path::Path;

use nephroid::{
    Camera, CameraId, Changes, Device, DeviceOptions, Light, LightId, Material, Mesh, Result, Scene, Session, Settings,
};

fn main() -> Result<()> {
    let picture = std::env::args().nth(1).unwrap_or_else(|| "moving_camera.png".into());
    let mut scene = Scene::default();
    scene.add(&Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]), Material::lambert([0.7, 0.6, 0.5]));
    scene.add(&Mesh::sphere([0.0, 0.5, 0.0], 0.5, 32, 64), Material::glass(1.5));
    let lamp = scene.add_light(Light::Point { position: [1.5, 2.0, 1.0], intensity: [4.0; 3] });
    let eye = scene.add_camera(Camera::look_at([0.0, 1.5, 4.0], [0.0, 0.4, 0.0], [0.0, 1.0, 0.0], 0.6));

    let device = Device::open(&DeviceOptions::default())?;
    let settings = Settings { width: 160, height: 120, photons: Some(30_000), ..Settings::default() };
    let mut session = Session::new(&device, scene, settings)?;
    for frame in 0..3 {
        let updated = session.update(at(frame, eye, lamp))?;
        println!("frame {frame}: {:?}", updated.steps);
        for pass in 0..4 {
            session.run_pass(pass)?;
        }
    }
    // The film holds the passes since the last change.
    session.picture()?.save(Path::new(&picture))?;
    println!("{picture}");
    device.check_validation()
}

/// The camera goes around the sphere, the lamp goes up.
fn at(frame: u32, eye: CameraId, lamp: LightId) -> Changes {
    let angle = 0.2 * frame as f32;
    let position = [4.0 * angle.sin(), 1.5, 4.0 * angle.cos()];
    let light = Light::Point { position: [1.5, 2.0 + 0.2 * frame as f32, 1.0], intensity: [4.0; 3] };
    Changes::new().camera(eye, Camera::look_at(position, [0.0, 0.4, 0.0], [0.0, 1.0, 0.0], 0.6)).light(lamp, light)
}
