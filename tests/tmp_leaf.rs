#![allow(missing_docs)]
use nephroid::graph::Runtime;
use nephroid::render::{Session, Settings};
use nephroid::vk::{Device, DeviceOptions};
fn cpu() -> f64 {
    let mut sum = 0u64;
    for t in std::fs::read_dir("/proc/self/task").unwrap() {
        if let Ok(s) = std::fs::read_to_string(t.unwrap().path().join("schedstat")) {
            sum += s.split_whitespace().next().unwrap().parse::<u64>().unwrap();
        }
    }
    sum as f64 * 1e-9
}
#[test]
#[ignore = "a measurement"]
fn table() {
    let options = DeviceOptions { select: "cpu".parse().unwrap(), validate: false, ..DeviceOptions::default() };
    let runtime = Runtime::new(Device::open(&options).unwrap());
    let repeats: usize = std::env::var("REPEATS").map_or(7, |x| x.parse().unwrap());
    let leaves: Vec<u32> = std::env::var("LEAVES").unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
    for name in std::env::var("SCENES").unwrap().split(' ') {
        let scene = nephroid::scene::load(std::path::Path::new(&format!("assets/{name}.glb")), &Default::default()).unwrap();
        let mut sessions: Vec<_> = leaves.iter().map(|&leaf| {
            let s = Settings { width: 160, height: 120, photons: std::env::var("PHOTONS").ok().map(|x| x.parse().unwrap()), leaf_photons: leaf, ..Settings::default() };
            let mut s = Session::new(&runtime, scene.clone(), s).unwrap();
            s.run_pass(0).unwrap();
            (leaf, s, vec![], vec![], vec![])
        }).collect();
        for _ in 0..repeats { for (_, s, times, shares, parts) in &mut sessions {
            let a = cpu(); s.run_pass(0).unwrap(); times.push(cpu() - a);
            let t = s.timings();
            let of = |n: &[&str]| t.iter().filter(|t| t.depth == 0 && (n.is_empty() || n.contains(&t.name.as_str()))).map(|t| (t.end_ns - t.start_ns) as f64).sum::<f64>();
            shares.push(of(&["photon map", "gather"]) / of(&[]));
            parts.push([of(&["photon map"]) * 1e-6, of(&["gather"]) * 1e-6]);
        } }
        let med = |v: &Vec<f64>| { let mut v = v.clone(); v.sort_by(f64::total_cmp); v[v.len() / 2] };
        let least = |v: &Vec<f64>| v.iter().copied().fold(f64::INFINITY, f64::min);
        println!("{name}: {} deposits", sessions[0].1.statistics().unwrap().deposits / (repeats as u64 + 1));
        let totals: Vec<f64> = sessions.iter().map(|s| least(&s.4.iter().map(|p| p[0] + p[1]).collect())).collect();
        let best = totals.iter().copied().fold(f64::INFINITY, f64::min);
        for ((leaf, _, times, _, parts), total) in sessions.iter().zip(&totals) {
            let l = |k: usize| least(&parts.iter().map(|p| p[k]).collect());
            println!("  T {leaf:3}: cpu {:7.2} (median {:7.2}) map {:7.2} gather {:7.2} (median {:7.2}) total {:7.2} rel {:.3}", 1e3*least(times), 1e3*med(times), l(0), l(1), med(&parts.iter().map(|p| p[1]).collect()), total, total/best);
        }
    }
}
