//! KHR_draco_mesh_compression: primitives that are stored packed.

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};

use super::document::Document;
use super::notes::{Notes, Outcome};
use super::part::Part;

/// A primitive that was unpacked.
pub(super) struct Packed<'a> {
    mesh: Mesh,
    /// Ids of attributes by their names.
    attributes: Part<'a>,
}

impl<'a> Packed<'a> {
    /// Unpacks what the extension `part` of a primitive names.
    pub fn of(document: &Document<'a>, part: &Part<'a>, notes: &mut Notes) -> Outcome<Self> {
        let at = |cause: String| format!("{}: {cause}", part.place);
        let view = part.index("bufferView")?.ok_or_else(|| at("it has no buffer view".into()))?;
        let attributes = part.part("attributes", notes).ok_or_else(|| at("it has no attributes".into()))?;
        let bytes = document.buffers.view(view as usize, notes).map_err(at)?.bytes;
        // Corners and values take a multiple of what the stream reconstructs.
        let most = document.buffers.left() / 4;
        let limits = DecodeLimits::default().with_max_decoded_bytes(most);
        let limits = limits.with_max_points(most / 16).with_max_faces(most / 16);
        let mut mesh = Mesh::new();
        let mut stream = DecoderBuffer::new(bytes).with_limits(limits);
        MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|cause| at(format!("damaged: {cause}")))?;
        document.buffers.charge(12 * mesh.num_faces() as u64 + 4 * mesh.num_points() as u64).map_err(at)?;
        Ok(Self { mesh, attributes })
    }

    /// Number of vertices.
    pub fn count(&self) -> usize {
        self.mesh.num_points()
    }

    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.mesh.faces().iter().map(|face| face.map(|point| point.0)).collect()
    }

    /// The values of an attribute, one for each vertex, if it is packed. Integers are shares of the largest
    /// one where `normalized`. What it lacks is `missing`.
    pub fn values<const N: usize>(&self, name: &str, normalized: bool, missing: f32) -> Outcome<Option<Vec<[f32; N]>>> {
        let Some(id) = self.attributes.index(name)? else { return Ok(None) };
        let attribute = self.mesh.attribute_by_unique_id(id);
        let attribute = attribute.ok_or_else(|| format!("{}: attribute {id} does not exist", self.attributes.place))?;
        let width = usize::from(attribute.num_components()).min(N);
        let scale = if normalized { 1.0 / largest(attribute.data_type()) } else { 1.0 };
        let flat = attribute.read_f32s(self.count(), width.max(1));
        let element = |values: &[f32]| std::array::from_fn(|k| if k < width { scale * values[k] } else { missing });
        Ok(Some(flat.chunks_exact(width.max(1)).map(element).collect()))
    }
}

fn largest(kind: DataType) -> f32 {
    match kind {
        DataType::Int8 => 127.0,
        DataType::Uint8 => 255.0,
        DataType::Int16 => 32767.0,
        DataType::Uint16 => 65535.0,
        _ => 1.0,
    }
}
