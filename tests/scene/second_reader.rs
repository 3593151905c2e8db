//! A reader of moving files of its own, written from the specification without regard to speed or damage: where every
//! corner of every triangle is at a time. It shares no code with the one that it checks.

use std::path::Path;

use serde_json::Value;

pub type Point = [f64; 3];
/// Columns of a matrix.
type Matrix = [[f64; 4]; 4];

pub struct Reader {
    root: Value,
    buffers: Vec<Vec<u8>>,
}

impl Reader {
    pub fn open(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let (json, blob) = if bytes.starts_with(b"glTF") {
            let end = 20 + word(12);
            (&bytes[20..end], Some(bytes[end + 8..end + 8 + word(end)].to_vec()))
        } else {
            (&bytes[..], None)
        };
        let root: Value = serde_json::from_slice(json).unwrap();
        let read = |buffer: &Value| match buffer["uri"].as_str() {
            None => blob.clone().unwrap(),
            Some(uri) => match uri.split_once(";base64,") {
                Some((_, text)) => base64(text),
                None => std::fs::read(path.with_file_name(uri)).unwrap(),
            },
        };
        let buffers = list(&root["buffers"]).iter().map(read).collect();
        Self { root, buffers }
    }

    /// First and last key of the animations.
    pub fn span(&self, animations: &[usize]) -> [f64; 2] {
        let times: Vec<f64> = self.channels(animations).flat_map(|(sampler, _)| self.times(&sampler)).collect();
        [times.iter().copied().fold(f64::INFINITY, f64::min), times.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Corners of all triangles at a time, mesh by mesh as the file lists them.
    pub fn corners(&self, animations: &[usize], time: f64) -> Vec<[Point; 3]> {
        let mut nodes = list(&self.root["nodes"]).to_vec();
        for (sampler, target) in self.channels(animations) {
            let (node, path) = (target["node"].as_u64().unwrap() as usize, target["path"].as_str().unwrap());
            nodes[node][path] = Value::from(self.value(&sampler, path, time));
        }
        let mut worlds = vec![identity(); nodes.len()];
        let mut order = Vec::new();
        for root in list(&self.root["scenes"][0]["nodes"]) {
            place(&nodes, index(root), identity(), (&mut worlds, &mut order));
        }
        let mut corners = Vec::new();
        for (m, mesh) in list(&self.root["meshes"]).iter().enumerate() {
            for primitive in list(&mesh["primitives"]) {
                for &n in order.iter().filter(|n| nodes[**n]["mesh"].as_u64() == Some(m as u64)) {
                    let weights = [&nodes[n]["weights"], &mesh["weights"]].into_iter().find(|w| w.is_array());
                    let weights = weights.map(numbers).unwrap_or_default();
                    corners.extend(self.triangles(primitive, &weights, (&nodes[n], worlds[n], &worlds)));
                }
            }
        }
        corners
    }

    fn channels(&self, animations: &[usize]) -> impl Iterator<Item = (Value, Value)> {
        animations.iter().flat_map(|animation| {
            let animation = &self.root["animations"][*animation];
            let pair = |channel: &Value| {
                (animation["samplers"][index(&channel["sampler"])].clone(), channel["target"].clone())
            };
            // Pointers move no corners in these files.
            list(&animation["channels"]).iter().map(pair).filter(|(_, target)| target["node"].is_u64())
        })
    }

    fn times(&self, sampler: &Value) -> Vec<f64> {
        self.accessor(&sampler["input"]).into_iter().flatten().collect()
    }

    /// Section 3.11 and appendix C of the specification.
    fn value(&self, sampler: &Value, path: &str, time: f64) -> Vec<f64> {
        let times = self.times(sampler);
        let mode = sampler["interpolation"].as_str().unwrap_or("LINEAR");
        let all: Vec<f64> = self.accessor(&sampler["output"]).into_iter().flatten().collect();
        let width = all.len() / times.len() / if mode == "CUBICSPLINE" { 3 } else { 1 };
        let key = |k: usize, part: usize| {
            let slot = if mode == "CUBICSPLINE" { 3 * k + part } else { k };
            &all[slot * width..(slot + 1) * width]
        };
        let last = times.len() - 1;
        let mut k = 0;
        while k < last && times[k + 1] <= time {
            k += 1;
        }
        if k == last || time <= times[0] || mode == "STEP" {
            return key(k, 1).to_vec();
        }
        let interval = times[k + 1] - times[k];
        let t = (time - times[k]) / interval;
        let (a, b) = (key(k, 1), key(k + 1, 1));
        if mode == "CUBICSPLINE" {
            let (out, into) = (key(k, 2), key(k + 1, 0));
            let hermite = |i: usize| {
                let (t2, t3) = (t.powi(2), t.powi(3));
                (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                    + interval * (t3 - 2.0 * t2 + t) * out[i]
                    + (3.0 * t2 - 2.0 * t3) * b[i]
                    + interval * (t3 - t2) * into[i]
            };
            return (0..width).map(hermite).collect();
        }
        let mut shares = [1.0 - t, t];
        if path == "rotation" {
            let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
            let angle = dot.abs().min(1.0).acos();
            if angle > 1e-6 {
                shares = [((1.0 - t) * angle).sin() / angle.sin(), (t * angle).sin() / angle.sin()];
            }
            shares[1] *= dot.signum();
        }
        a.iter().zip(b).map(|(x, y)| shares[0] * x + shares[1] * y).collect()
    }

    fn triangles(
        &self,
        primitive: &Value,
        weights: &[f64],
        (node, world, worlds): (&Value, Matrix, &[Matrix]),
    ) -> Vec<[Point; 3]> {
        let attributes = &primitive["attributes"];
        let mut positions = self.accessor(&attributes["POSITION"]);
        for (target, weight) in list(&primitive["targets"]).iter().zip(weights) {
            for (position, moved) in positions.iter_mut().zip(self.accessor(&target["POSITION"])) {
                (0..3).for_each(|i| position[i] += weight * moved[i]);
            }
        }
        let placed: Vec<Point> = if node["skin"].is_u64() {
            let skin = &self.root["skins"][index(&node["skin"])];
            let inverse = self.accessor(&skin["inverseBindMatrices"]);
            let joints = list(&skin["joints"]).iter().zip(inverse);
            let joints: Vec<Matrix> = joints.map(|(n, m)| product(worlds[index(n)], matrix(&m))).collect();
            let (chosen, shares) = (self.accessor(&attributes["JOINTS_0"]), self.accessor(&attributes["WEIGHTS_0"]));
            let blend = |v: usize| {
                let images = (0..4).map(|i| (shares[v][i], apply(joints[chosen[v][i] as usize], &positions[v])));
                let sum = images.fold([0.0; 3], |sum, (w, p)| [0, 1, 2].map(|k| sum[k] + w * p[k]));
                sum.map(|x| x / shares[v].iter().sum::<f64>())
            };
            (0..positions.len()).map(blend).collect()
        } else {
            positions.iter().map(|p| apply(world, p)).collect()
        };
        let order: Vec<usize> = match primitive["indices"].is_u64() {
            true => self.accessor(&primitive["indices"]).iter().map(|i| i[0] as usize).collect(),
            false => (0..placed.len()).collect(),
        };
        order.chunks_exact(3).map(|t| [placed[t[0]], placed[t[1]], placed[t[2]]]).collect()
    }

    fn accessor(&self, at: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.root["accessors"][index(at)];
        let width = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("{other}"),
        };
        let component = accessor["componentType"].as_u64().unwrap();
        let count = index(&accessor["count"]);
        let mut values = vec![vec![0.0; width]; count];
        if accessor["bufferView"].is_u64() {
            values = self.view(accessor, component, (width, count));
        }
        if accessor["sparse"].is_object() {
            let (sparse, count) = (&accessor["sparse"], index(&accessor["sparse"]["count"]));
            let places =
                self.view(&sparse["indices"], sparse["indices"]["componentType"].as_u64().unwrap(), (1, count));
            for (place, value) in places.iter().zip(self.view(&sparse["values"], component, (width, count))) {
                values[place[0] as usize] = value;
            }
        }
        if accessor["normalized"].as_bool() == Some(true) {
            let most = match component {
                5120 => 127.0,
                5121 => 255.0,
                5122 => 32767.0,
                _ => 65535.0,
            };
            values.iter_mut().flatten().for_each(|x| *x = (*x / most).max(-1.0));
        }
        values
    }

    fn view(&self, part: &Value, component: u64, (width, count): (usize, usize)) -> Vec<Vec<f64>> {
        let view = &self.root["bufferViews"][index(&part["bufferView"])];
        let offset = |part: &Value| part["byteOffset"].as_u64().unwrap_or(0) as usize;
        let bytes = &self.buffers[index(&view["buffer"])][offset(view) + offset(part)..];
        let size = match component {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            _ => 4,
        };
        let stride = view["byteStride"].as_u64().map_or(size * width, |stride| stride as usize);
        let number = |at: usize| match component {
            5120 => f64::from(bytes[at] as i8),
            5121 => f64::from(bytes[at]),
            5122 => f64::from(i16::from_le_bytes([bytes[at], bytes[at + 1]])),
            5123 => f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]])),
            5125 => f64::from(u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())),
            _ => f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())),
        };
        (0..count).map(|i| (0..width).map(|k| number(i * stride + k * size)).collect()).collect()
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn index(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(|x| x.as_f64().unwrap()).collect()
}

fn base64(text: &str) -> Vec<u8> {
    let digit = |b: u8| match b {
        b'A'..=b'Z' => Some(b - b'A'),
        b'a'..=b'z' => Some(b - b'a' + 26),
        b'0'..=b'9' => Some(b - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let (mut bytes, mut bits, mut held) = (Vec::new(), 0u32, 0);
    for six in text.bytes().filter_map(digit) {
        bits = bits << 6 | u32::from(six);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    bytes
}

fn identity() -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| if c == r { 1.0 } else { 0.0 }))
}

fn matrix(columns: &[f64]) -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| columns[4 * c + r]))
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|c| std::array::from_fn(|r| (0..4).map(|k| a[k][r] * b[c][k]).sum()))
}

fn apply(m: Matrix, p: &[f64]) -> Point {
    std::array::from_fn(|r| m[0][r] * p[0] + m[1][r] * p[1] + m[2][r] * p[2] + m[3][r])
}

/// Translation, rotation and scale, or the matrix of a node.
fn local(node: &Value) -> Matrix {
    if node["matrix"].is_array() {
        return matrix(&numbers(&node["matrix"]));
    }
    let or = |name: &str, default: &[f64]| match node[name].is_array() {
        true => numbers(&node[name]),
        false => default.to_vec(),
    };
    let (t, s) = (or("translation", &[0.0; 3]), or("scale", &[1.0; 3]));
    let q = or("rotation", &[0.0, 0.0, 0.0, 1.0]);
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z, w] = [0, 1, 2, 3].map(|i| q[i] / length);
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let column = |c: usize| match c {
        3 => [t[0], t[1], t[2], 1.0],
        _ => [rows[0][c] * s[c], rows[1][c] * s[c], rows[2][c] * s[c], 0.0],
    };
    [column(0), column(1), column(2), column(3)]
}

fn place(nodes: &[Value], node: usize, parent: Matrix, (worlds, order): (&mut Vec<Matrix>, &mut Vec<usize>)) {
    worlds[node] = product(parent, local(&nodes[node]));
    order.push(node);
    for child in list(&nodes[node]["children"]) {
        place(nodes, index(child), worlds[node], (worlds, order));
    }
}
