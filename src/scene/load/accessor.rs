//! Checked reading of accessors: any component type, normalisation, stride and sparse substitution.

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, buffer::View};

use super::document::Document;
use super::{Limits, Outcome};

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
}

impl Use {
    fn shapes(self) -> &'static [Type] {
        match self {
            Self::Position | Self::Normal | Self::Vector => &[Type::Vec3],
            Self::Uv => &[Type::Vec2],
            Self::Color => &[Type::Vec3, Type::Vec4],
            Self::Tangent | Self::Joints | Self::Weights | Self::Rotation => &[Type::Vec4],
            Self::Matrix => &[Type::Mat4],
        }
    }

    fn takes(self, component: ComponentType, normalized: bool, quantized: bool) -> bool {
        use ComponentType::{F32, I8, I16, U8, U16, U32};
        let small = !matches!(component, F32 | U32);
        match self {
            Self::Joints => matches!(component, U8 | U16) && !normalized,
            _ if component == F32 => true,
            Self::Position => quantized && small,
            Self::Normal | Self::Tangent => quantized && matches!(component, I8 | I16) && normalized,
            Self::Uv => small && (quantized || (matches!(component, U8 | U16) && normalized)),
            Self::Color | Self::Weights => matches!(component, U8 | U16) && normalized,
            Self::Rotation => matches!(component, I8 | I16) && normalized,
            Self::Matrix | Self::Vector => false,
        }
    }
}

/// Most elements of an accessor without a buffer view, which costs memory but no bytes in the file.
const MOST_ZEROS: u64 = 1 << 22;

/// Reads accessors of one document within a budget.
pub(super) struct Reader<'a> {
    document: &'a Document,
    elements_left: u64,
}

/// Elements of an accessor in memory.
struct Layout<'a> {
    /// From the first element to the end of the view; `None` stands for zeros.
    bytes: Option<&'a [u8]>,
    stride: usize,
    count: usize,
    component: ComponentType,
    width: usize,
    normalized: bool,
}

impl<'a> Reader<'a> {
    pub fn new(document: &'a Document, limits: &Limits) -> Self {
        Self { document, elements_left: limits.elements }
    }

    /// Number of elements, without reading them.
    pub fn count(&self, index: Index<Accessor>) -> Outcome<u64> {
        Ok(self.accessor(index)?.count.0)
    }

    /// Elements as `N` floats each. Components that the file lacks are 1 (the alpha of a colour).
    pub fn floats<const N: usize>(&mut self, index: Index<Accessor>, role: Use) -> Outcome<Vec<[f32; N]>> {
        let at = |cause| format!("accessor {}: {cause}", index.value());
        let accessor = self.accessor(index)?;
        let layout = self.layout(accessor).map_err(at)?;
        let shape = valid(&accessor.type_)?;
        if !role.shapes().contains(&shape) || !role.takes(layout.component, layout.normalized, self.document.quantized)
        {
            let normalized = if layout.normalized { "normalized " } else { "" };
            return Err(at(format!("{shape:?} of {normalized}{:?} cannot be read as {role:?}", layout.component)));
        }
        let mut values = vec![[1.0; N]; layout.count];
        for (i, value) in values.iter_mut().enumerate() {
            layout.element(i, &mut value[..layout.width.min(N)]);
        }
        self.substitute(accessor, &layout, |i, source, k| source.element(k, &mut values[i][..source.width.min(N)]))
            .map_err(at)?;
        Ok(values)
    }

    /// Scalar unsigned integers.
    pub fn indices(&mut self, index: Index<Accessor>) -> Outcome<Vec<u32>> {
        let at = |cause| format!("accessor {}: {cause}", index.value());
        let accessor = self.accessor(index)?;
        let layout = self.layout(accessor).map_err(at)?;
        let unsigned = matches!(layout.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if valid(&accessor.type_)? != Type::Scalar || !unsigned || layout.normalized {
            return Err(at("indices must be scalars of an unsigned type".into()));
        }
        let mut values: Vec<u32> = (0..layout.count).map(|i| layout.integer(i)).collect();
        self.substitute(accessor, &layout, |i, source, k| values[i] = source.integer(k)).map_err(at)?;
        Ok(values)
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: Index<View>) -> Outcome<&'a [u8]> {
        self.view_and_stride(index).map(|(bytes, _)| bytes)
    }

    fn view_and_stride(&self, index: Index<View>) -> Outcome<(&'a [u8], Option<usize>)> {
        let i = index.value();
        let document = self.document;
        let view = document.root.buffer_views.get(i).ok_or_else(|| format!("buffer view {i} does not exist"))?;
        let buffer = document.buffers.get(view.buffer.value());
        let buffer = buffer.ok_or_else(|| format!("buffer view {i}: its buffer does not exist"))?;
        let bytes = slice(buffer, view.byte_offset.map_or(0, |o| o.0), view.byte_length.0);
        let bytes = bytes.ok_or_else(|| format!("buffer view {i} reaches beyond its buffer"))?;
        Ok((bytes, view.byte_stride.map(|s| s.0)))
    }

    fn accessor(&self, index: Index<Accessor>) -> Outcome<&'a Accessor> {
        let i = index.value();
        self.document.root.accessors.get(i).ok_or_else(|| format!("accessor {i} does not exist"))
    }

    fn layout(&mut self, accessor: &Accessor) -> Outcome<Layout<'a>> {
        let count = accessor.count.0;
        if count == 0 {
            return Err("it has no elements".into());
        }
        let most = if accessor.buffer_view.is_some() { u64::MAX } else { MOST_ZEROS };
        if count > self.elements_left.min(most) {
            return Err(format!("{count} elements, more than the limit on what is read in all"));
        }
        self.elements_left -= count;
        let component = valid(&accessor.component_type)?.0;
        let width = valid(&accessor.type_)?.multiplicity();
        let size = component.size() * width;
        let mut layout = Layout {
            bytes: None,
            stride: size,
            count: count as usize,
            component,
            width,
            normalized: accessor.normalized,
        };
        if let Some(view) = accessor.buffer_view {
            let (bytes, stride) = self.view_and_stride(view)?;
            layout.stride = stride.unwrap_or(size);
            layout.bytes = Some(elements(bytes, accessor.byte_offset.map_or(0, |o| o.0), &layout, size)?);
        }
        Ok(layout)
    }

    /// Calls `put(element, source, source element)` for every sparse substitution.
    fn substitute(
        &mut self,
        accessor: &Accessor,
        layout: &Layout,
        mut put: impl FnMut(usize, &Layout, usize),
    ) -> Outcome<()> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        if sparse.count.0 == 0 || sparse.count.0 > layout.count as u64 {
            return Err(format!("{} sparse values for {} elements", sparse.count.0, layout.count));
        }
        let count = sparse.count.0 as usize;
        let part = |component: ComponentType, width, normalized| Layout {
            bytes: None,
            stride: component.size() * width,
            count,
            component,
            width,
            normalized,
        };
        let mut indices = part(valid(&sparse.indices.component_type)?.0, 1, false);
        let bytes = self.view(sparse.indices.buffer_view)?;
        indices.bytes = Some(elements(bytes, sparse.indices.byte_offset.0, &indices, indices.stride)?);
        let mut values = part(layout.component, layout.width, layout.normalized);
        let bytes = self.view(sparse.values.buffer_view)?;
        values.bytes = Some(elements(bytes, sparse.values.byte_offset.0, &values, values.stride)?);
        for k in 0..count {
            let target = indices.integer(k) as usize;
            if target >= layout.count {
                return Err(format!("sparse index {target} is out of range"));
            }
            put(target, &values, k);
        }
        Ok(())
    }
}

/// The bytes from the first element on; fails where the last one does not fit.
fn elements<'a>(view: &'a [u8], offset: u64, layout: &Layout, size: usize) -> Outcome<&'a [u8]> {
    if layout.stride < size {
        return Err(format!("a stride of {} bytes for elements of {size}", layout.stride));
    }
    let span = (layout.count as u64 - 1).checked_mul(layout.stride as u64).and_then(|s| s.checked_add(size as u64));
    let end = span.and_then(|s| s.checked_add(offset)).unwrap_or(u64::MAX);
    if end > view.len() as u64 {
        return Err(format!("{} bytes are missing", end - view.len() as u64));
    }
    Ok(&view[offset as usize..])
}

fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = offset.checked_add(length)?;
    bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
}

fn valid<T: Copy>(value: &Checked<T>) -> Outcome<T> {
    match value {
        Checked::Valid(value) => Ok(*value),
        Checked::Invalid => Err("unknown type".into()),
    }
}

impl Layout<'_> {
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
            (ComponentType::I8, [a]) => (f32::from(*a as i8), 127.0),
            (ComponentType::U8, [a]) => (f32::from(*a), 255.0),
            (ComponentType::I16, [a, b]) => (f32::from(i16::from_le_bytes([*a, *b])), 32767.0),
            (ComponentType::U16, [a, b]) => (f32::from(u16::from_le_bytes([*a, *b])), 65535.0),
            (ComponentType::F32, [a, b, c, d]) => return f32::from_le_bytes([*a, *b, *c, *d]),
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
