//! Rays per second on a glTF scene of plain meshes: `rays SCENE.gltf [REPEATS]`.
//!
//! Primary rays of a 1024 x 1024 camera in Morton order, shadow rays from their hits to a point light above the scene, and
//! cosine-distributed rays from the hits.

use std::path::Path;
use std::time::Instant;

use nephroid::kernels::bvh_host::{TriangleTag, build_sah, pack_triangles};
use nephroid::kernels::generated::{BvhNode, BvhTriangle, Ray, RayHit};
use nephroid::kernels::trace::{self, MISS, Tree};
use nephroid::{error::Result, graph::*, vk};

type V3 = [f32; 3];

fn add(a: V3, b: V3) -> V3 {
    std::array::from_fn(|i| a[i] + b[i])
}
fn sub(a: V3, b: V3) -> V3 {
    std::array::from_fn(|i| a[i] - b[i])
}
fn scale(a: V3, s: f32) -> V3 {
    a.map(|x| x * s)
}
fn dot(a: V3, b: V3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn normalize(a: V3) -> V3 {
    scale(a, 1.0 / dot(a, a).sqrt())
}
fn xyz([x, y, z, _]: [f32; 4]) -> V3 {
    [x, y, z]
}

/// A mesh and its camera.
struct Mesh {
    positions: Vec<V3>,
    triangles: Vec<[u32; 3]>,
    camera: [f32; 16],
    yfov: f32,
}

/// All meshes of a scene without transforms (but the camera's) and with one binary buffer.
fn load(path: &Path) -> Mesh {
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path).expect("scene file")).expect("JSON");
    let uri = json["buffers"][0]["uri"].as_str().expect("uri");
    let bytes = std::fs::read(path.parent().expect("a folder").join(uri)).expect("buffer");
    let slice = |accessor: &serde_json::Value, size: usize| -> &[u8] {
        let accessor = &json["accessors"][accessor.as_u64().expect("index") as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().expect("view") as usize];
        let start = view["byteOffset"].as_u64().unwrap_or(0) + accessor["byteOffset"].as_u64().unwrap_or(0);
        &bytes[start as usize..][..accessor["count"].as_u64().expect("count") as usize * size]
    };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in json["meshes"].as_array().expect("meshes") {
        for primitive in mesh["primitives"].as_array().expect("primitives") {
            let base = positions.len() as u32;
            positions.extend(bytemuck::pod_collect_to_vec::<u8, V3>(slice(&primitive["attributes"]["POSITION"], 12)));
            let corners = bytemuck::pod_collect_to_vec::<u8, u32>(slice(&primitive["indices"], 4));
            triangles.extend(corners.chunks_exact(3).map(|c| [base + c[0], base + c[1], base + c[2]]));
        }
    }
    let nodes = json["nodes"].as_array().expect("nodes");
    let node = nodes.iter().find(|n| n.get("camera").is_some()).expect("a camera");
    let camera = std::array::from_fn(|i| node["matrix"][i].as_f64().expect("matrix") as f32);
    let yfov = json["cameras"][0]["perspective"]["yfov"].as_f64().expect("yfov") as f32;
    Mesh { positions, triangles, camera, yfov }
}

/// Even bits of a Morton code.
fn compact(mut x: u32) -> u32 {
    x &= 0x5555_5555;
    for (shift, mask) in [(1, 0x3333_3333), (2, 0x0f0f_0f0f), (4, 0x00ff_00ff), (8, 0xffff)] {
        x = (x | (x >> shift)) & mask;
    }
    x
}

fn primary(mesh: &Mesh, size: u32) -> Vec<Ray> {
    let column = |c: usize| [mesh.camera[4 * c], mesh.camera[4 * c + 1], mesh.camera[4 * c + 2]];
    let t = (0.5 * mesh.yfov).tan();
    let place = |p: u32| ((p as f32 + 0.5) / size as f32 * 2.0 - 1.0) * t;
    let pixel = |index| {
        let (x, y) = (place(compact(index)), place(compact(index >> 1)));
        let direction = sub(sub(scale(column(0), x), scale(column(1), y)), column(2));
        trace::ray(column(3), normalize(direction), f32::INFINITY)
    };
    (0..size * size).map(pixel).collect()
}

/// The scene on the device.
struct Scene {
    mesh: Mesh,
    runtime: Runtime,
    nodes: Persistent<BvhNode>,
    triangles: Persistent<BvhTriangle>,
    order: Vec<u32>,
    repeats: u32,
}

impl Scene {
    /// Times a pass over the rays and returns what it wrote.
    fn run<T: bytemuck::Pod>(
        &self,
        name: &'static str,
        rays: &[Ray],
        pass: impl Fn(&mut Graph, Tree<'_>, &Buf<Ray>, &mut Buf<T>),
    ) -> Result<Vec<T>> {
        let persistent = self.runtime.persistent_from("rays", rays)?;
        let mut g = Graph::new();
        let (nodes, triangles) = (g.import_read(&self.nodes), g.import_read(&self.triangles));
        let rays_buf = g.import_read(&persistent);
        let mut out = g.buffer::<T>("answers", rays.len() as u32);
        g.scope(name, |g| pass(g, Tree { nodes: &nodes, triangles: &triangles }, &rays_buf, &mut out));
        let readback = g.readback(&out);
        let mut executable = self.runtime.prepare(&g.plan().expect("a valid plan"))?;
        executable.run()?; // compiles
        let mut times = Vec::new();
        for _ in 0..self.repeats {
            executable.run()?;
            let timing = &executable.timings()[0];
            times.push((timing.end_ns - timing.start_ns) as f64 * 1e-9);
        }
        times.sort_by(f64::total_cmp);
        let rate = |t: f64| rays.len() as f64 / t * 1e-6;
        let (best, median) = (rate(times[0]), rate(times[times.len() / 2]));
        println!("{name:8} {:8} rays  best {best:6.3}  median {median:6.3} Mrays/s", rays.len());
        Ok(executable.read(&readback))
    }
}

/// Shadow rays and diffuse rays from the hits.
fn secondary(scene: &Scene, rays: &[Ray], hits: &[RayHit], light: V3) -> (Vec<Ray>, Vec<Ray>) {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (((word >> 22) ^ word) >> 8) as f32 / 16_777_216.0
    };
    let (mut shadow, mut diffuse) = (Vec::new(), Vec::new());
    for (ray, hit) in rays.iter().zip(hits).filter(|(_, hit)| hit.triangle != MISS) {
        let id = scene.order[hit.triangle as usize] as usize;
        let [a, b, c] = scene.mesh.triangles[id].map(|corner| scene.mesh.positions[corner as usize]);
        let corners = [a, b, c];
        let mut normal = normalize(cross(sub(b, a), sub(c, a)));
        if dot(normal, xyz(ray.direction)) > 0.0 {
            normal = scale(normal, -1.0);
        }
        let origin = trace::offset_ray_origin(corners, [hit.b1, hit.b2], normal);
        shadow.push(trace::ray(origin, sub(light, origin), 1.0));
        let (r, phi) = (random().sqrt(), random() * std::f32::consts::TAU);
        let (x, y, z) = (r * phi.cos(), r * phi.sin(), (1.0 - r * r).max(0.0).sqrt());
        let helper = if normal[0].abs() > 0.5 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] };
        let u = normalize(cross(helper, normal));
        let v = cross(normal, u);
        diffuse.push(trace::ray(origin, add(add(scale(u, x), scale(v, y)), scale(normal, z)), f32::INFINITY));
    }
    (shadow, diffuse)
}

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("usage: rays SCENE.gltf [REPEATS]");
    let repeats = arguments.next().map_or(5, |n| n.parse().expect("a number"));
    let mesh = load(Path::new(&path));
    let start = Instant::now();
    let tree = build_sah(&mesh.positions, &mesh.triangles);
    let (seconds, count) = (start.elapsed().as_secs_f64(), mesh.triangles.len());
    println!("{count} triangles, {} nodes, depth {}, built in {seconds:.3} s", tree.nodes.len(), tree.depth);
    let packed = pack_triangles(&mesh.positions, &mesh.triangles, &tree.order, |_| TriangleTag::default());
    let device = vk::Device::open(&vk::DeviceOptions::default())?;
    println!("{}", device.info().name);
    let runtime = Runtime::new(device);
    let nodes = runtime.persistent_from("nodes", &tree.nodes)?;
    let triangles = runtime.persistent_from("triangles", &packed)?;
    let scene = Scene { mesh, runtime, nodes, triangles, order: tree.order, repeats };
    let rays = primary(&scene.mesh, 1024);
    let hits = scene.run("primary", &rays, trace::closest)?;
    let (shadow, diffuse) = secondary(&scene, &rays, &hits, [3.0, 8.0, 4.0]);
    let occluded = scene.run("shadow", &shadow, trace::any)?;
    let bounced = scene.run("diffuse", &diffuse, trace::closest)?;
    let share = |hits: &[RayHit]| hits.iter().filter(|h| h.triangle != MISS).count() as f64 / hits.len() as f64;
    let blocked = occluded.iter().sum::<u32>() as f64 / shadow.len() as f64;
    println!("hit rates: primary {:.4}, shadow {blocked:.4}, diffuse {:.4}", share(&hits), share(&bounced));
    Ok(())
}
