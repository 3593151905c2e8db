//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views that are stored packed.
//!
//! Written from appendices A and B of KHR_meshopt_compression, which hold for the older extension as well: its streams
//! are version 0. Streams come from anywhere. What one unpacks to is known beforehand from its count and stride, and a
//! stream that ends too early or has bytes left is refused.

mod attributes;
mod filters;
mod indices;

use super::notes::{Notes, Outcome, clip};
use super::part::Part;

/// Both have the same members.
pub(super) const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Most elements of a stream: accessors have no more.
const MOST_ELEMENTS: u64 = u32::MAX as u64;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Attributes(Filter),
    Triangles,
    Indices,
}

/// What is done to attributes after they are unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// How a view is packed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stream {
    mode: Mode,
    count: usize,
    stride: usize,
}

impl Stream {
    /// As the extension `part` of a view describes it.
    pub fn of(part: &Part) -> Outcome<Self> {
        let at = |cause: String| format!("{}: {cause}", part.place);
        let count = part.count("count")?.filter(|count| *count <= MOST_ELEMENTS);
        let count = count.ok_or_else(|| at("it has no count that is possible".into()))?;
        let stride = part.count("byteStride")?.unwrap_or(0);
        let filter = match part.text("filter", &mut Notes::default()).as_deref() {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
            Some(filter) => return Err(at(format!("the filter {} is unknown", clip(filter)))),
        };
        let mode = match part.text("mode", &mut Notes::default()).as_deref() {
            Some("ATTRIBUTES") => Mode::Attributes(filter),
            Some("TRIANGLES") => Mode::Triangles,
            Some("INDICES") => Mode::Indices,
            mode => return Err(at(format!("the mode {} is unknown", clip(mode.unwrap_or("none"))))),
        };
        let fits = match mode {
            Mode::Attributes(Filter::Octahedral | Filter::Color) => stride == 4 || stride == 8,
            Mode::Attributes(Filter::Quaternion) => stride == 8,
            Mode::Attributes(_) => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            Mode::Triangles => (stride == 2 || stride == 4) && count.is_multiple_of(3),
            Mode::Indices => stride == 2 || stride == 4,
        };
        if !fits {
            return Err(at(format!("{count} elements of {stride} bytes do not go with {mode:?}")));
        }
        Ok(Self { mode, count: count as usize, stride: stride as usize })
    }

    /// Bytes of an element.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Bytes that it unpacks to.
    pub fn bytes(&self) -> u64 {
        self.count as u64 * self.stride as u64
    }

    /// Unpacks all of `packed`.
    pub fn unpack(&self, packed: &[u8]) -> Outcome<Vec<u8>> {
        let Self { mode, count, stride } = *self;
        match mode {
            Mode::Triangles => indices::triangles(packed, count, stride),
            Mode::Indices => indices::sequence(packed, count, stride),
            Mode::Attributes(filter) => {
                let mut bytes = attributes::unpack(packed, count, stride)?;
                filters::apply(filter, stride, &mut bytes);
                Ok(bytes)
            }
        }
    }
}

/// Reads a stream from its front.
struct Cursor<'a> {
    left: &'a [u8],
}

impl<'a> Cursor<'a> {
    /// The next bytes.
    fn take(&mut self, count: usize) -> Outcome<&'a [u8]> {
        let (taken, left) = self.left.split_at_checked(count).ok_or("the stream ends too early")?;
        self.left = left;
        Ok(taken)
    }

    fn byte(&mut self) -> Outcome<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    /// A number in groups of seven bits, the lowest first.
    fn varint(&mut self) -> Outcome<u32> {
        let mut value = 0;
        for group in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << (7 * group);
            if byte & 128 == 0 {
                return Ok(value);
            }
        }
        Err("a number of the stream has no end".into())
    }

    fn finish(&self) -> Outcome<()> {
        if self.left.is_empty() { Ok(()) } else { Err(format!("{} bytes of the stream are left", self.left.len())) }
    }
}

/// The body of a stream: what is between its header and the last `tail` bytes; and the tail.
fn body(packed: &[u8], header: u8, tail: usize) -> Outcome<(Cursor<'_>, &[u8])> {
    match packed.split_first() {
        Some((first, rest)) if *first == header => {
            let middle = rest.len().checked_sub(tail).ok_or("the stream ends too early")?;
            let (left, tail) = rest.split_at(middle);
            Ok((Cursor { left }, tail))
        }
        _ => Err("the stream has another header".into()),
    }
}

/// A signed number that was folded into an unsigned one: 0, -1, 1, -2.
fn unfold(value: u32) -> u32 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

#[cfg(test)]
mod tests;
