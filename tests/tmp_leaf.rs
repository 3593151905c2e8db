use nephroid::bench::{PhotonMapEffort, photon_map};
use nephroid::graph::Runtime;
use nephroid::vk::{Device, DeviceOptions};
#[test]
#[ignore = "a measurement"]
fn table() {
    let options = DeviceOptions { select: "cpu".parse().unwrap(), validate: false, ..DeviceOptions::default() };
    let runtime = Runtime::new(Device::open(&options).unwrap());
    for name in std::env::var("SCENES").unwrap().split(' ') {
        let scene =
            nephroid::scene::load(std::path::Path::new(&format!("assets/{name}.glb")), &Default::default()).unwrap();
        let effort = PhotonMapEffort {
            size: [160, 120],
            photons: std::env::var("PHOTONS").ok().map(|x| x.parse().unwrap()),
            repeats: std::env::var("REPEATS").map_or(7, |x| x.parse().unwrap()),
        };
        let r = photon_map(&runtime, &scene, effort, &mut |_| ()).unwrap();
        println!("{name}: {} photons, coverage {:.2}", r.photons, r.coverage);
        let best = r.leaves.iter().map(|l| l.total).fold(f64::INFINITY, f64::min);
        for l in &r.leaves {
            println!(
                "  T {:3}: build {:7.2} gather {:7.2} total {:7.2} ms  rel {:.3} noise {:.3}",
                l.leaf,
                1e3 * l.build,
                1e3 * l.gather,
                1e3 * l.total,
                l.total / best,
                l.noise
            );
        }
    }
}
