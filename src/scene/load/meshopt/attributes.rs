//! Mode 0: elements as differences, byte by byte.

use super::{Cursor, body};
use crate::scene::load::notes::Outcome;

/// Elements that share the bits of their differences.
const GROUP: usize = 16;
/// Most elements of a block.
const BLOCK: usize = 256;

/// Bits of a difference by the mode of its group.
const VERSION_0: [u32; 4] = [0, 2, 4, 8];
/// The same by the control mode of a byte.
const VERSION_1: [[u32; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// How the differences of four bytes of an element are meant.
#[derive(Clone, Copy)]
enum Channel {
    /// Byte by byte, with the sign in the lowest bit.
    Bytes,
    /// As two numbers of 16 bits, likewise.
    Shorts,
    /// As 32 bits of which those are set that change, turned left by so many places.
    Changes(u32),
}

/// Unpacks `count` elements of `stride` bytes, a multiple of 4 of at most 256.
pub(super) fn unpack(packed: &[u8], count: usize, stride: usize) -> Outcome<Vec<u8>> {
    let version = match packed.first() {
        Some(0xa0) => 0,
        Some(0xa1) => 1,
        _ => return Err("the stream has another header".into()),
    };
    let (tail, least) = if version == 0 { (stride, 32) } else { (stride + stride / 4, 24) };
    let (mut cursor, end) = body(packed, 0xa0 + version, tail.max(least))?;
    let (last, modes) = end[end.len() - tail..].split_at(stride);
    let channels = channels(modes, stride)?;
    let mut last = last.to_vec();
    let mut elements = Vec::with_capacity(count * stride);
    let most = ((8192 / stride) & !(GROUP - 1)).min(BLOCK);
    let mut differences = vec![0; stride * BLOCK];
    while elements.len() < count * stride {
        let block = (count - elements.len() / stride).min(most);
        read_block(&mut cursor, version, block, &mut differences)?;
        for element in 0..block {
            for (c, channel) in channels.iter().enumerate() {
                let delta = std::array::from_fn(|k| differences[(4 * c + k) * BLOCK + element]);
                let value = next(*channel, &last[4 * c..][..4], delta);
                last[4 * c..][..4].copy_from_slice(&value);
            }
            elements.extend_from_slice(&last);
        }
    }
    cursor.finish()?;
    Ok(elements)
}

fn channels(modes: &[u8], stride: usize) -> Outcome<Vec<Channel>> {
    if modes.is_empty() {
        return Ok(vec![Channel::Bytes; stride / 4]);
    }
    let channel = |mode: &u8| match (mode & 15, mode >> 4) {
        (0, 0) => Ok(Channel::Bytes),
        (1, 0) => Ok(Channel::Shorts),
        (2, turn) => Ok(Channel::Changes(turn.into())),
        _ => Err(format!("the channel mode {mode} is unknown")),
    };
    modes.iter().map(channel).collect()
}

/// The four bytes of an element from those of the one before it.
fn next(channel: Channel, last: &[u8], delta: [u8; 4]) -> [u8; 4] {
    let unfold = |value: u32| super::unfold(value);
    match channel {
        Channel::Bytes => std::array::from_fn(|k| last[k].wrapping_add(unfold(delta[k].into()) as u8)),
        Channel::Shorts => {
            let short = |k: usize| {
                let (old, delta) = ([last[k], last[k + 1]], [delta[k], delta[k + 1]]);
                let step = unfold(u16::from_le_bytes(delta).into()) as u16;
                u16::from_le_bytes(old).wrapping_add(step).to_le_bytes()
            };
            let [[a, b], [c, d]] = [short(0), short(2)];
            [a, b, c, d]
        }
        Channel::Changes(turn) => {
            let old = u32::from_le_bytes([last[0], last[1], last[2], last[3]]);
            (old ^ u32::from_le_bytes(delta).rotate_right(turn)).to_le_bytes()
        }
    }
}

/// The differences of a block of `count` elements: `BLOCK` for each byte of an element.
fn read_block(cursor: &mut Cursor, version: u8, count: usize, differences: &mut [u8]) -> Outcome<()> {
    let stride = differences.len() / BLOCK;
    let controls = if version == 0 { &[][..] } else { cursor.take(stride / 4)? };
    for (byte, out) in differences.chunks_exact_mut(BLOCK).enumerate() {
        let control = controls.get(byte / 4).map(|controls| controls >> (2 * (byte % 4)) & 3);
        match control {
            None => read_byte(cursor, VERSION_0, count, out)?,
            Some(2) => out.fill(0),
            Some(3) => out[..count].copy_from_slice(cursor.take(count)?),
            Some(control) => read_byte(cursor, VERSION_1[usize::from(control & 1)], count, out)?,
        }
    }
    Ok(())
}

/// The differences of one byte of the elements of a block.
fn read_byte(cursor: &mut Cursor, widths: [u32; 4], count: usize, out: &mut [u8]) -> Outcome<()> {
    let groups = count.div_ceil(GROUP);
    let modes = cursor.take(groups.div_ceil(4))?;
    for (group, out) in out.chunks_exact_mut(GROUP).take(groups).enumerate() {
        let mode = modes[group / 4] >> (2 * (group % 4)) & 3;
        match widths[usize::from(mode)] {
            0 => out.fill(0),
            8 => out.copy_from_slice(cursor.take(GROUP)?),
            bits => read_group(cursor, bits, out)?,
        }
    }
    Ok(())
}

/// Sixteen differences of 1, 2 or 4 bits. Where all bits are set a whole byte follows after them.
fn read_group(cursor: &mut Cursor, bits: u32, out: &mut [u8]) -> Outcome<()> {
    let packed = cursor.take(GROUP * bits as usize / 8)?;
    let per_byte = 8 / bits as usize;
    let all = (1 << bits) - 1;
    for (i, value) in out.iter_mut().enumerate() {
        let place = (i % per_byte) as u32 * bits;
        // Single bits begin with the lowest one, the others with the highest.
        let shift = if bits == 1 { place } else { 8 - bits - place };
        *value = packed[i / per_byte] >> shift & all;
        if *value == all {
            *value = cursor.byte()?;
        }
    }
    Ok(())
}
