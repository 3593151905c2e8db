//! Renders a glTF scene to a picture.
//!
//! ```text
//! cargo run --release --example render_file -- assets/ring.glb ring.png
//! ```

use std::path::Path;

use nephroid::{Device, DeviceOptions, Result, Scene, Session, Settings};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or_else(|| "assets/ring.glb".into());
    let picture = arguments.next().unwrap_or_else(|| "ring.png".into());

    let scene = Scene::load(Path::new(&file))?;
    for warning in &scene.warnings {
        eprintln!("{warning}");
    }
    let device = Device::open(&DeviceOptions::default())?;
    let mut session = Session::new(&device, scene, Settings { width: 320, height: 240, ..Settings::default() })?;
    for pass in 0..8 {
        session.run_pass(pass)?;
        if let Some(error) = session.error_estimate()?.relative {
            println!("pass {pass}: about {:.0} % wrong", 100.0 * error);
        }
    }
    session.picture()?.save(Path::new(&picture))?;
    println!("{picture}");
    device.check_validation()
}
