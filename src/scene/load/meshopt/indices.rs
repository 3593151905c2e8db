//! Modes 1 and 2: triangles and sequences of indices.

use super::{Cursor, body, unfold};
use crate::scene::load::notes::Outcome;

/// The most recent entries, the newest first.
struct Recent<T> {
    entries: [Option<T>; 16],
    newest: usize,
}

impl<T: Copy> Recent<T> {
    fn new() -> Self {
        Self { entries: [None; 16], newest: 0 }
    }

    fn push(&mut self, entry: T) {
        self.newest = (self.newest + 1) % 16;
        self.entries[self.newest] = Some(entry);
    }

    fn get(&self, age: u8) -> Outcome<T> {
        let entry = self.entries[(self.newest + 16 - usize::from(age & 15)) % 16];
        entry.ok_or_else(|| "the stream repeats what it has not said".into())
    }
}

/// What the decoder of triangles remembers.
struct Triangles<'a> {
    data: Cursor<'a>,
    table: &'a [u8],
    /// The next index that was not used before.
    next: u32,
    /// The last index that was given explicitly.
    last: u32,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
}

/// Unpacks `count` indices of triangles, of `size` bytes each.
pub(super) fn triangles(packed: &[u8], count: usize, size: usize) -> Outcome<Vec<u8>> {
    let (mut data, table) = body(packed, 0xe1, 16)?;
    let codes = data.take(count / 3)?;
    if table[14..] != [0, 0] || table.iter().any(|entry| entry & 15 == 15 || entry >> 4 == 15) {
        return Err("the table of the stream is damaged".into());
    }
    let (edges, vertices) = (Recent::new(), Recent::new());
    let mut triangles = Triangles { data, table, next: 0, last: 0, edges, vertices };
    let mut bytes = Vec::with_capacity(count * size);
    for code in codes {
        let triangle = triangles.decode(*code)?;
        triangle.iter().for_each(|index| bytes.extend_from_slice(&index.to_le_bytes()[..size]));
    }
    triangles.data.finish()?;
    Ok(bytes)
}

impl Triangles<'_> {
    fn decode(&mut self, code: u8) -> Outcome<[u32; 3]> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 { self.at_edge(high, low) } else { self.free(low) }
    }

    /// A triangle at a recent edge.
    fn at_edge(&mut self, age: u8, vertex: u8) -> Outcome<[u32; 3]> {
        let [a, b] = self.edges.get(age)?;
        let c = match vertex {
            0 => self.unused(),
            1..=12 => self.vertices.get(vertex)?,
            13 => self.nearby(u32::MAX),
            14 => self.nearby(1),
            _ => self.explicit()?,
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if !(1..=12).contains(&vertex) {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    /// A triangle that shares no recent edge.
    fn free(&mut self, low: u8) -> Outcome<[u32; 3]> {
        let is_explicit = low >= 14;
        let pair = if is_explicit { self.data.byte()? } else { self.table[usize::from(low)] };
        if is_explicit && pair == 0 {
            self.next = 0;
        }
        let a = if low == 15 { self.explicit()? } else { self.unused() };
        let (second, third) = (pair >> 4, pair & 15);
        let b = self.vertex(second)?;
        let c = self.vertex(third)?;
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        self.vertices.push(a);
        for (vertex, how) in [(b, second), (c, third)] {
            if how == 0 || how == 15 {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }

    fn vertex(&mut self, how: u8) -> Outcome<u32> {
        match how {
            0 => Ok(self.unused()),
            1..=14 => self.vertices.get(how - 1),
            _ => self.explicit(),
        }
    }

    fn unused(&mut self) -> u32 {
        let index = self.next;
        self.next = index.wrapping_add(1);
        index
    }

    fn nearby(&mut self, step: u32) -> u32 {
        self.last = self.last.wrapping_add(step);
        self.last
    }

    fn explicit(&mut self) -> Outcome<u32> {
        let step = unfold(self.data.varint()?);
        Ok(self.nearby(step))
    }
}

/// Unpacks `count` indices of `size` bytes each.
pub(super) fn sequence(packed: &[u8], count: usize, size: usize) -> Outcome<Vec<u8>> {
    let (mut data, _) = body(packed, 0xd1, 4)?;
    let mut last = [0u32; 2];
    let mut bytes = Vec::with_capacity(count * size);
    for _ in 0..count {
        let value = data.varint()?;
        let baseline = &mut last[value as usize & 1];
        *baseline = baseline.wrapping_add(unfold(value >> 1));
        bytes.extend_from_slice(&baseline.to_le_bytes()[..size]);
    }
    data.finish()?;
    Ok(bytes)
}
