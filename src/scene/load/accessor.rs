//! Checked reading of accessors: any component type, normalisation, stride and sparse substitution.

use std::cell::Cell;

use super::Limits;
use super::document::Document;
use super::notes::{Notes, Outcome, clip};
use super::part::Part;

/// What an accessor is read for; decides which types are allowed (glTF 2.0, section 3.7.2.1, and
/// KHR_mesh_quantization).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// Vertex position, or its morph displacement.
    Position,
    /// Vertex normal, or the morph displacement of a normal or tangent.
    Normal,
    /// Tangent with handedness.
    Tangent,
    /// Texture coordinate.
    Uv,
    /// Vertex colour; alpha 1 is added to RGB.
    Color,
    /// Joint indices of a vertex.
    Joints,
    /// Joint weights of a vertex.
    Weights,
    /// Inverse bind matrix.
    Matrix,
    /// Instance translation or scale.
    Vector,
    /// Instance rotation.
    Rotation,
    /// Vertex index.
    Index,
    /// Times of the keys of an animation.
    Time,
    /// Values of these keys, rotations apart.
    Keys,
}

/// The type of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// Whether a type may stand for a use.
#[derive(PartialEq, Eq)]
enum Fit {
    Allowed,
    /// Clear enough to be read, with a warning.
    Odd,
    Wrong,
}

impl Use {
    /// Numbers that an element may have.
    fn widths(self) -> &'static [usize] {
        match self {
            Self::Index | Self::Time => &[1],
            Self::Keys => &[1, 2, 3, 4],
            Self::Position | Self::Normal | Self::Vector => &[3],
            Self::Uv => &[2],
            Self::Color => &[3, 4],
            Self::Tangent | Self::Joints | Self::Weights | Self::Rotation => &[4],
            Self::Matrix => &[16],
        }
    }

    fn fit(self, component: Component, normalized: bool, quantized: bool) -> Fit {
        use Component::{F32, I8, I16, U8, U16, U32};
        let small = !matches!(component, F32 | U32);
        let short = matches!(component, U8 | U16);
        let signed = matches!(component, I8 | I16);
        let (allowed, odd) = match self {
            Self::Index => ((short || component == U32) && !normalized, false),
            Self::Joints => (short && !normalized, true),
            _ if component == F32 => (true, false),
            Self::Position => (quantized && small, small),
            Self::Normal | Self::Tangent => (quantized && signed && normalized, signed),
            Self::Uv => (small && (quantized || (short && normalized)), small),
            Self::Color | Self::Weights => (short && normalized, short),
            Self::Rotation => (signed && normalized, false),
            Self::Matrix | Self::Vector | Self::Time => (false, false),
            // Truth values are single bytes, and stay 0 and 1.
            Self::Keys => (small && (normalized || component == U8), small),
        };
        if allowed {
            Fit::Allowed
        } else if odd {
            Fit::Odd
        } else {
            Fit::Wrong
        }
    }
}

/// Most elements of an accessor without a buffer view, which costs memory but no bytes in the file.
const MOST_ZEROS: u64 = 1 << 22;

/// Reads accessors of one document within a budget.
pub(super) struct Reader<'a> {
    document: &'a Document<'a>,
    elements_left: Cell<u64>,
}

/// An accessor that can be read.
pub(super) struct Elements<'a> {
    place: String,
    layout: Layout<'a>,
    sparse: Option<Sparse<'a>>,
}

struct Sparse<'a> {
    indices: Layout<'a>,
    values: Layout<'a>,
}

/// Elements of an accessor in memory.
#[derive(Clone, Copy)]
struct Layout<'a> {
    /// From the first element to the end of the view; `None` stands for zeros.
    bytes: Option<&'a [u8]>,
    stride: usize,
    count: usize,
    component: Component,
    width: usize,
    normalized: bool,
}

impl<'a> Reader<'a> {
    pub fn new(document: &'a Document<'a>, limits: &Limits) -> Self {
        Self { document, elements_left: limits.elements.into() }
    }

    /// An accessor as something that it is fit for.
    pub fn open(&self, index: u32, role: Use, notes: &mut Notes) -> Outcome<Elements<'a>> {
        let part = self.document.accessors.part(index as usize)?;
        let at = |cause: String| format!("{}: {cause}", part.place);
        let mut layout = self.layout(&part, notes).map_err(at)?;
        let fit = role.fit(layout.component, layout.normalized, self.document.quantized);
        let kind = || {
            let normalized = if layout.normalized { "normalized " } else { "" };
            format!("{} x {normalized}{:?}", layout.width, layout.component)
        };
        if !role.widths().contains(&layout.width) || fit == Fit::Wrong {
            return Err(at(format!("{} cannot be read as {role:?}", kind())));
        }
        if fit == Fit::Odd {
            notes.fault(at(format!("{} is not meant for {role:?}", kind())));
        }
        layout.normalized |= matches!(role, Use::Color | Use::Weights);
        let sparse = part.part("sparse", notes).and_then(|sparse| {
            let read = self.sparse(&sparse, &layout, notes).map_err(|cause| at(format!("sparse: {cause}")));
            notes.or_fault(read)
        });
        Ok(Elements { layout, sparse, place: part.place })
    }

    /// Elements as `N` floats each, those that `pick` lists or all. Components that the file lacks are 1 (alpha of
    /// a colour). The list must be sorted, and its entries below the count.
    pub fn floats<const N: usize>(&self, elements: &Elements, pick: Option<&[u32]>) -> Outcome<Vec<[f32; N]>> {
        let count = pick.map_or(elements.layout.count, <[u32]>::len);
        self.charge(elements, count, size_of::<[f32; N]>())?;
        let width = elements.layout.width.min(N);
        let mut values = vec![[1.0; N]; count];
        for (i, value) in values.iter_mut().enumerate() {
            elements.layout.element(pick.map_or(i, |pick| pick[i] as usize), &mut value[..width]);
        }
        elements.substitute(pick, |i, source, k| source.element(k, &mut values[i][..width]));
        Ok(values)
    }

    /// All numbers of all elements, one after the other.
    pub fn numbers(&self, elements: &Elements) -> Outcome<Vec<f32>> {
        let width = elements.width();
        self.charge(elements, elements.count(), width * size_of::<f32>())?;
        let mut values = vec![0.0; elements.count() * width];
        let mut chunks = values.chunks_exact_mut(width);
        chunks.by_ref().enumerate().for_each(|(i, value)| elements.layout.element(i, value));
        elements.substitute(None, |i, source, k| source.element(k, &mut values[i * width..][..width]));
        Ok(values)
    }

    /// Scalar unsigned integers.
    pub fn integers(&self, elements: &Elements) -> Outcome<Vec<u32>> {
        self.charge(elements, elements.count(), size_of::<u32>())?;
        let mut values: Vec<u32> = (0..elements.count()).map(|i| elements.layout.integer(i)).collect();
        elements.substitute(None, |i, source, k| values[i] = source.integer(k));
        Ok(values)
    }

    /// Asks for the memory of elements before they are read.
    fn charge(&self, elements: &Elements, count: usize, size: usize) -> Outcome<()> {
        let at = |cause: String| format!("{}: {cause}", elements.place);
        let left = self.elements_left.get().checked_sub(count as u64);
        let left = left.ok_or_else(|| at(format!("{count} elements, more than the limit on what is read in all")))?;
        self.elements_left.set(left);
        self.document.buffers.charge(count as u64 * size as u64).map_err(at)
    }

    fn layout(&self, part: &Part, notes: &mut Notes) -> Outcome<Layout<'a>> {
        let count = part.count("count")?.filter(|count| *count > 0).ok_or("it has no elements")?;
        let view = part.index("bufferView")?;
        if count > if view.is_some() { u64::from(u32::MAX) } else { MOST_ZEROS } {
            return Err(format!("{count} elements, more than the limit"));
        }
        let component = component(part.count("componentType")?)?;
        let width = width(part, notes)?;
        let size = component.size() * width;
        let normalized = part.flag("normalized", notes).unwrap_or(false);
        let mut layout = Layout { bytes: None, stride: size, count: count as usize, component, width, normalized };
        if let Some(view) = view {
            let view = self.document.buffers.view(view as usize, notes)?;
            layout.stride = view.stride.unwrap_or(size);
            let missing = layout.place(view.bytes, part.count("byteOffset")?.unwrap_or(0), size)?;
            if missing > 0 {
                notes.fault(format!("{}: {missing} bytes are missing", part.place));
            }
        }
        Ok(layout)
    }

    /// The values that take the place of elements (glTF 2.0, section 3.6.2.3).
    fn sparse(&self, part: &Part, layout: &Layout, notes: &mut Notes) -> Outcome<Sparse<'a>> {
        let count = part.count("count")?.unwrap_or(0);
        if count == 0 || count > layout.count as u64 {
            return Err(format!("{count} values for {} elements", layout.count));
        }
        let mut read = |name: &str, component: Option<Component>| {
            let inner = part.part(name, notes).ok_or_else(|| format!("it has no {name}"))?;
            let (component, width) = match component {
                Some(component) => (component, layout.width),
                None => (self::component(inner.count("componentType")?)?, 1),
            };
            let stride = component.size() * width;
            let mut list = Layout { bytes: None, stride, count: count as usize, component, width, ..*layout };
            let view = inner.index("bufferView")?.ok_or_else(|| format!("its {name} have no buffer view"))?;
            let view = self.document.buffers.view(view as usize, notes)?;
            match list.place(view.bytes, inner.count("byteOffset")?.unwrap_or(0), stride)? {
                0 => Ok(list),
                missing => Err(format!("{missing} bytes are missing")),
            }
        };
        let (indices, values) = (read("indices", None)?, read("values", Some(layout.component))?);
        let wrong = (0..indices.count).map(|k| indices.integer(k)).find(|index| *index as usize >= layout.count);
        if let Some(index) = wrong {
            notes.fault(format!("sparse index {index} is out of range"));
        }
        Ok(Sparse { indices, values })
    }
}

impl Elements<'_> {
    pub fn count(&self) -> usize {
        self.layout.count
    }

    /// Numbers of each.
    pub fn width(&self) -> usize {
        self.layout.width
    }

    /// Calls `put(place in the result, source, source element)` for every sparse substitution.
    fn substitute(&self, pick: Option<&[u32]>, mut put: impl FnMut(usize, &Layout, usize)) {
        let Some(Sparse { indices, values }) = &self.sparse else { return };
        for k in 0..indices.count {
            let target = indices.integer(k);
            let place = match pick {
                Some(pick) => pick.binary_search(&target).ok(),
                None => Some(target as usize).filter(|target| *target < self.layout.count),
            };
            if let Some(place) = place {
                put(place, values, k);
            }
        }
    }
}

fn component(code: Option<u64>) -> Outcome<Component> {
    Ok(match code {
        Some(5120) => Component::I8,
        Some(5121) => Component::U8,
        Some(5122) => Component::I16,
        Some(5123) => Component::U16,
        Some(5125) => Component::U32,
        Some(5126) => Component::F32,
        Some(code) => return Err(format!("componentType {code} is unknown")),
        None => return Err("it has no componentType".into()),
    })
}

/// Numbers of an element.
fn width(part: &Part, notes: &mut Notes) -> Outcome<usize> {
    let kind = part.text("type", notes).ok_or("it has no type")?;
    Ok(match kind.as_ref() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return Err(format!("the type {} is unknown", clip(&kind))),
    })
}

impl Component {
    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

impl<'a> Layout<'a> {
    /// Finds the elements of `size` bytes from `offset` on in a view; returns how many bytes are missing for the last
    /// one. Then as many elements are left as there are whole, at least one.
    fn place(&mut self, view: &'a [u8], offset: u64, size: usize) -> Outcome<u64> {
        if self.stride < size {
            return Err(format!("a stride of {} bytes for elements of {size}", self.stride));
        }
        let (stride, size, count) = (self.stride as u64, size as u64, self.count as u64);
        let room = (view.len() as u64).saturating_sub(offset);
        let wanted = (count - 1).saturating_mul(stride).saturating_add(size);
        let missing = wanted.saturating_sub(room);
        if room < size {
            return Err(format!("{missing} bytes are missing"));
        }
        self.count = count.min((room - size) / stride + 1) as usize;
        self.bytes = Some(&view[offset as usize..]);
        Ok(missing)
    }

    /// The first components of element `i`. Zeros if there are no bytes.
    fn element(&self, i: usize, out: &mut [f32]) {
        let Some(bytes) = self.bytes else { return out.fill(0.0) };
        let size = self.component.size();
        let start = i * self.stride;
        for (k, value) in out.iter_mut().enumerate() {
            *value = self.component(&bytes[start + k * size..][..size]);
        }
    }

    /// Normalised integers as the specification's section 3.6.2.2 has it.
    fn component(&self, bytes: &[u8]) -> f32 {
        let (value, largest) = match (self.component, bytes) {
            (Component::I8, [a]) => (f32::from(*a as i8), 127.0),
            (Component::U8, [a]) => (f32::from(*a), 255.0),
            (Component::I16, [a, b]) => (f32::from(i16::from_le_bytes([*a, *b])), 32767.0),
            (Component::U16, [a, b]) => (f32::from(u16::from_le_bytes([*a, *b])), 65535.0),
            (Component::F32, [a, b, c, d]) => return f32::from_le_bytes([*a, *b, *c, *d]),
            _ => (unsigned(bytes) as f32, u32::MAX as f32),
        };
        if self.normalized { (value / largest).max(-1.0) } else { value }
    }

    fn integer(&self, i: usize) -> u32 {
        self.bytes.map_or(0, |bytes| unsigned(&bytes[i * self.stride..][..self.component.size()]))
    }
}

/// A little-endian unsigned integer of up to four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}
