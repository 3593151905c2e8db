//! Ways to damage a file.

use serde_json::Value;

use crate::support::random::Random;

/// Below `end`, which is not 0.
pub fn below(random: &mut Random, end: usize) -> usize {
    (random.bits() % end as u64) as usize
}

fn one_of<T: Copy>(random: &mut Random, all: &[T]) -> T {
    all[below(random, all.len())]
}

/// Numbers at which programs go wrong.
const NUMBERS: [u64; 12] = [
    0,
    1,
    2,
    0x7f,
    0xff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
    0x7f80_0000,
    0x7fc0_0000,
];

/// Changes some bytes: one to eight times, each in one of the ways below.
pub fn bytes(random: &mut Random, bytes: &mut Vec<u8>, other: &[u8]) {
    for _ in 0..=below(random, 8) {
        if bytes.is_empty() {
            return;
        }
        let at = place(random, bytes.len());
        match below(random, 8) {
            0 => bytes[at] ^= 1 << below(random, 8),
            1 => bytes[at] = random.bits() as u8,
            2 | 3 => {
                let value = one_of(random, &NUMBERS).wrapping_add(random.bits() % 3).wrapping_sub(1).to_le_bytes();
                let length = one_of(random, &[2, 4, 8]).min(bytes.len() - at);
                bytes[at..at + length].copy_from_slice(&value[..length]);
            }
            4 => bytes.truncate(at),
            5 => drop(bytes.drain(at..(at + 1 + below(random, 16)).min(bytes.len()))),
            6 => {
                let end = (at + 1 + below(random, 64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = below(random, bytes.len());
                bytes.splice(to..to, copy);
            }
            _ if !other.is_empty() => {
                let from = below(random, other.len());
                let end = (from + 1 + below(random, 256)).min(other.len());
                let end_here = (at + end - from).min(bytes.len());
                bytes.splice(at..end_here, other[from..end].iter().copied());
            }
            _ => {}
        }
    }
}

/// Half of the damage is in the header, where a little does much.
fn place(random: &mut Random, length: usize) -> usize {
    let end = if random.bits() & 1 == 0 { length.min(512) } else { length };
    below(random, end)
}

/// Changes one to three values of a JSON text: to another kind, an extreme number, a copy of a value elsewhere, or
/// nothing.
pub fn json(random: &mut Random, root: &mut Value) {
    for _ in 0..=below(random, 3) {
        let mut paths = Vec::new();
        collect("", root, &mut paths);
        let (to, from) = (one_of(random, &(0..paths.len()).collect::<Vec<_>>()), below(random, paths.len()));
        let copy = root.pointer(&paths[from]).cloned().unwrap_or_default();
        let Some(value) = root.pointer_mut(&paths[to]) else { continue };
        *value = match below(random, 9) {
            0 => Value::Null,
            1 => one_of(random, &NUMBERS).into(),
            2 => one_of(random, &[-1.0, 0.5, 1e30, -1e308, 1e-320]).into(),
            3 => Value::String(one_of(random, &["", "\u{1b}[2J\n", "../../x", "data:,", "\u{202e}a"]).into()),
            4 => Value::Array(vec![copy; below(random, 40)]),
            5 => serde_json::json!({}),
            6 => (value.as_u64().unwrap_or(0).wrapping_add(1)).into(),
            _ => copy,
        };
    }
}

/// The pointers of all values below `value`.
fn collect(path: &str, value: &Value, paths: &mut Vec<String>) {
    paths.push(path.to_owned());
    match value {
        Value::Array(items) => {
            items.iter().enumerate().for_each(|(index, item)| collect(&format!("{path}/{index}"), item, paths));
        }
        Value::Object(items) => {
            let escaped = |name: &str| name.replace('~', "~0").replace('/', "~1");
            items.iter().for_each(|(name, item)| collect(&format!("{path}/{}", escaped(name)), item, paths));
        }
        _ => {}
    }
}
