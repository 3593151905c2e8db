//! Renders three moments of a file that has animations, each blurred by an open shutter, with one session.
//!
//! ```text
//! cargo run --release --example moving_scene -- moving_scene.png assets/banner.glb
//! ```

use std::path::Path;

use nephroid::{Device, DeviceOptions, Result, Scene, Session, Settings, Shutter};

fn main() -> Result<()> {
    let picture = std::env::args().nth(1).unwrap_or_else(|| "moving_scene.png".into());
    let file = std::env::args().nth(2).unwrap_or_else(|| "assets/banner.glb".into());
    let scene = Scene::load(Path::new(&file))?;
    let [start, end] = scene.motion.as_ref().map_or([0.0; 2], |motion| motion.span());
    println!("{file} moves from {start} s to {end} s");

    let device = Device::open(&DeviceOptions::default())?;
    let settings = Settings { width: 160, height: 120, photons: Some(30_000), ..Settings::default() };
    let mut session = Session::new(&device, scene, settings)?;
    for frame in 0..3 {
        let open = start + (end - start) * f64::from(frame) / 3.0;
        let updated = session.show(open, Some(Shutter { open, close: open + 0.02 }))?;
        println!("{open:.3} s: {:?}", updated.steps);
        for pass in 0..4 {
            session.run_pass(pass)?;
        }
    }
    // The film holds the passes of the last moment.
    session.picture()?.save(Path::new(&picture))?;
    println!("{picture}");
    device.check_validation()
}
