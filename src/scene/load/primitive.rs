//! Primitives: their triangles, and the vertices that these use.

use std::sync::Arc;

use super::accessor::{Elements, Reader, Use};
use super::document::Document;
use super::draco::Packed;
use super::notes::{Notes, Outcome, clip};
use super::part::Part;
use crate::scene::motion::Influence;
use crate::scene::world::Needed;
use crate::scene::{MaterialId, Mesh};

/// A decoded primitive: a mesh in its own space, and what may bend it.
#[derive(Default)]
pub(super) struct Primitive {
    pub mesh: Mesh,
    pub targets: Vec<Target>,
    pub influences: Arc<Vec<Influence>>,
    /// The vertices of the file that the mesh has, in their order, if it has not all of them.
    pick: Option<Vec<u32>>,
    /// Vertices in the file.
    count: usize,
}

/// Accessors of a morph target. They are read where a weight asks for them.
pub(super) struct Target {
    pub positions: Option<u32>,
    pub normals: Option<u32>,
    pub tangents: Option<u32>,
}

/// How vertices make triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    List,
    Strip,
    Fan,
    /// Points and lines.
    NoTriangles,
}

impl Mode {
    fn of(part: &Part) -> Outcome<Self> {
        Ok(match part.count("mode")?.unwrap_or(4) {
            0..=3 => Self::NoTriangles,
            4 => Self::List,
            5 => Self::Strip,
            6 => Self::Fan,
            mode => return Err(format!("the mode {mode} is unknown")),
        })
    }

    /// Triangles of so many indices.
    fn triangles(self, indices: u64) -> u64 {
        match self {
            Self::List => indices / 3,
            Self::Strip | Self::Fan => indices.saturating_sub(2),
            Self::NoTriangles => 0,
        }
    }
}

/// Triangles of a primitive by what its accessors say, without reading them; 0 where something is wrong.
pub(super) fn announced_triangles(document: &Document, part: &Part) -> u64 {
    let quiet = &mut Notes::default();
    let positions = || part.part("attributes", &mut Notes::default())?.index("POSITION").ok().flatten();
    let vertices = part.index("indices").ok().flatten().or_else(positions);
    let accessor = vertices.and_then(|index| document.accessors.part(index as usize).ok());
    let count = accessor.and_then(|accessor| quiet.or_fault(accessor.count("count")).flatten()).unwrap_or(0);
    Mode::of(part).map_or(0, |mode| mode.triangles(count))
}

/// Reads primitives.
pub(super) struct PrimitiveReader<'r, 'a> {
    pub document: &'a Document<'a>,
    pub reader: &'r Reader<'a>,
    pub needed: &'r Needed,
    /// The sets of the file that are the mesh's two sets of texture coordinates.
    pub uv_sets: [u64; 2],
    /// Whether joints move some of its instances.
    pub skinned: bool,
}

impl<'a> PrimitiveReader<'_, 'a> {
    /// Decodes a primitive; `None` for points and lines.
    pub fn read(&self, part: &Part<'a>, material: MaterialId, notes: &mut Notes) -> Outcome<Option<Primitive>> {
        let mode = Mode::of(part)?;
        if mode == Mode::NoTriangles {
            return Ok(None);
        }
        let attributes = part.part("attributes", notes).ok_or("it has no attributes")?;
        let mut primitive = match self.packed(part, notes)? {
            Some(packed) => self.read_packed(&attributes, packed, notes)?,
            None => self.read_plain(part, mode, &attributes, notes)?,
        };
        primitive.mesh.material = material;
        primitive.targets = targets(part, notes);
        Ok(Some(primitive))
    }

    /// What KHR_draco_mesh_compression holds of a primitive. Without it there are accessors, if the file allows for
    /// readers that do not know the extension.
    fn packed(&self, part: &Part<'a>, notes: &mut Notes) -> Outcome<Option<Packed<'a>>> {
        let Some(extension) = part.extension("KHR_draco_mesh_compression", notes) else { return Ok(None) };
        match Packed::of(self.document, &extension, notes) {
            Err(cause) if !self.document.needs_draco => {
                notes.fault(format!("{cause}; its plain accessors are read"));
                Ok(None)
            }
            unpacked => unpacked.map(Some),
        }
    }

    fn read_packed(&self, attributes: &Part, packed: Packed, notes: &mut Notes) -> Outcome<Primitive> {
        let mut primitive = Primitive { count: packed.count(), ..Primitive::default() };
        primitive.mesh.triangles = packed.triangles();
        primitive.mesh.positions = packed.values("POSITION", false, 0.0)?.ok_or("it has no POSITION")?;
        self.attributes(attributes, Some(&packed), &mut primitive, notes);
        Ok(primitive)
    }

    fn read_plain(&self, part: &Part, mode: Mode, attributes: &Part, notes: &mut Notes) -> Outcome<Primitive> {
        let position = attributes.index("POSITION")?.ok_or("it has no POSITION")?;
        let positions = self.reader.open(position, Use::Position, notes)?;
        let mut primitive = Primitive { count: positions.count(), ..Primitive::default() };
        primitive.mesh.triangles = self.triangles(part, mode, positions.count(), notes)?;
        primitive.drop_unused_vertices();
        primitive.mesh.positions = self.reader.floats(&positions, primitive.pick.as_deref())?;
        self.attributes(attributes, None, &mut primitive, notes);
        Ok(primitive)
    }

    /// The triangles whose vertices exist.
    fn triangles(&self, part: &Part, mode: Mode, count: usize, notes: &mut Notes) -> Outcome<Vec<[u32; 3]>> {
        let indices = match part.index("indices")? {
            Some(accessor) => self.reader.integers(&self.reader.open(accessor, Use::Index, notes)?)?,
            None => {
                self.document.buffers.charge(4 * count as u64)?;
                (0..count as u32).collect()
            }
        };
        self.document.buffers.charge(12 * mode.triangles(indices.len() as u64))?;
        let mut triangles = triangles(mode, &indices);
        let all = triangles.len();
        triangles.retain(|triangle| triangle.iter().all(|vertex| (*vertex as usize) < count));
        if triangles.len() < all {
            let wrong = indices.iter().find(|vertex| **vertex as usize >= count).unwrap_or(&0);
            let lost = all - triangles.len();
            notes.loss(format!(
                "{}: vertex index {wrong} is out of range of {count} vertices: {lost} triangle(s) were skipped",
                part.place
            ));
        }
        Ok(triangles)
    }

    /// Everything but positions. What cannot be read is left out.
    fn attributes(&self, attributes: &Part, packed: Option<&Packed>, primitive: &mut Primitive, notes: &mut Notes) {
        for (name, _) in attributes.members().filter(|(name, _)| !is_known(name)) {
            notes.fault(format!("{}: the attribute {} is unknown; it is ignored", attributes.place, clip(name)));
        }
        let pick = primitive.pick.take();
        let picked = Picked { attributes, packed, pick: pick.as_deref(), count: primitive.count };
        let mesh = &mut primitive.mesh;
        mesh.normals = self.optional(&picked, "NORMAL", Use::Normal, notes);
        if self.needed.tangents {
            mesh.tangents = self.optional(&picked, "TANGENT", Use::Tangent, notes);
        }
        for (set, of_file) in self.uv_sets.into_iter().enumerate().filter(|(set, _)| self.needed.uvs[*set]) {
            mesh.uvs[set] = self.optional(&picked, &format!("TEXCOORD_{of_file}"), Use::Uv, notes);
        }
        mesh.colors = self.optional(&picked, "COLOR_0", Use::Color, notes);
        if self.skinned {
            primitive.influences = Arc::new(self.influences(&picked, notes));
        }
        primitive.pick = pick;
    }

    fn influences(&self, picked: &Picked, notes: &mut Notes) -> Vec<Influence> {
        let mut influences = Vec::new();
        for set in 0.. {
            let [joints, weights] = ["JOINTS", "WEIGHTS"].map(|name| format!("{name}_{set}"));
            if !picked.attributes.has(&joints) || !picked.attributes.has(&weights) {
                break;
            }
            let joints = self.optional(picked, &joints, Use::Joints, notes);
            let weights = self.optional(picked, &weights, Use::Weights, notes);
            if !joints.is_empty() && !weights.is_empty() {
                influences.push(Influence { joints, weights });
            }
        }
        influences
    }

    /// An attribute of the vertices in use, or nothing.
    fn optional<const N: usize>(&self, picked: &Picked, name: &str, role: Use, notes: &mut Notes) -> Vec<[f32; N]> {
        let values = picked.attributes.index(name).and_then(|accessor| {
            let Some(accessor) = accessor else { return Ok(Vec::new()) };
            if let Some(values) = picked.unpacked(self.document, (name, accessor), role)? {
                return Ok(values);
            }
            let elements = self.reader.open(accessor, role, notes)?;
            picked.read(self.reader, &elements, role)
        });
        let place = &picked.attributes.place;
        notes
            .or_fault(values.map_err(|cause: String| format!("{place}: {name} is ignored: {cause}")))
            .unwrap_or_default()
    }
}

/// The attributes of a primitive and the vertices that are read of them.
struct Picked<'p> {
    attributes: &'p Part<'p>,
    packed: Option<&'p Packed<'p>>,
    pick: Option<&'p [u32]>,
    count: usize,
}

impl Picked<'_> {
    /// An attribute that is stored packed.
    fn unpacked<const N: usize>(
        &self,
        document: &Document,
        (name, accessor): (&str, u32),
        role: Use,
    ) -> Outcome<Option<Vec<[f32; N]>>> {
        let Some(packed) = self.packed else { return Ok(None) };
        let accessor = document.accessors.part(accessor as usize);
        let normalized = accessor.is_ok_and(|part| part.flag("normalized", &mut Notes::default()) == Some(true));
        document.buffers.charge((self.count * size_of::<[f32; N]>()) as u64)?;
        packed.values(name, normalized || matches!(role, Use::Color | Use::Weights), 1.0)
    }

    fn read<const N: usize>(&self, reader: &Reader, elements: &Elements, role: Use) -> Outcome<Vec<[f32; N]>> {
        match elements.count() {
            count if count == self.count => reader.floats(elements, self.pick),
            count => Err(format!("{count} elements of {role:?} for {} vertices", self.count)),
        }
    }
}

/// Whether an attribute is one of the standard or of an application.
fn is_known(name: &str) -> bool {
    let numbered = |name: &str| {
        let number = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"].iter().find_map(|start| name.strip_prefix(start));
        number.is_some_and(|number| number.parse::<u32>().is_ok())
    };
    name.starts_with('_') || matches!(name, "POSITION" | "NORMAL" | "TANGENT") || numbered(name)
}

fn targets(part: &Part, notes: &mut Notes) -> Vec<Target> {
    let mut targets = Vec::new();
    for (i, json) in part.list("targets", notes).into_iter().enumerate() {
        let target = notes.or_fault(Part::of(format!("{}.targets[{i}]", part.place), json));
        let mut index = |name| target.as_ref().and_then(|target| notes.or_fault(target.index(name)).flatten());
        targets.push(Target { positions: index("POSITION"), normals: index("NORMAL"), tangents: index("TANGENT") });
    }
    targets
}

/// The triangles of a list, strip or fan (glTF 2.0, section 3.7.2.1).
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::Strip => {
            let turned =
                |i: usize, w: &[u32]| if i.is_multiple_of(2) { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
            indices.windows(3).enumerate().map(|(i, w)| turned(i, w)).collect()
        }
        Mode::Fan => match indices.split_first() {
            Some((first, rest)) => rest.windows(2).map(|w| [w[0], w[1], *first]).collect(),
            None => Vec::new(),
        },
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

impl Primitive {
    /// Displacements of the vertices in use, or nothing.
    pub fn displacements(
        &self,
        reader: &Reader,
        accessor: Option<u32>,
        role: Use,
        notes: &mut Notes,
    ) -> Outcome<Vec<[f32; 3]>> {
        let Some(accessor) = accessor else { return Ok(Vec::new()) };
        let elements = reader.open(accessor, role, notes)?;
        if elements.count() != self.count {
            return Err(format!("{} elements of {role:?} for {} vertices", elements.count(), self.count));
        }
        reader.floats(&elements, self.pick.as_deref())
    }

    /// Keeps only vertices that a triangle uses: many primitives may share one long list, and the limit on triangles
    /// bounds the vertices as well.
    fn drop_unused_vertices(&mut self) {
        let triangles = &mut self.mesh.triangles;
        let used = vertices_of(triangles, self.count);
        if used.len() == self.count {
            return;
        }
        for vertex in triangles.iter_mut().flatten() {
            // Every vertex of a triangle is in the list.
            *vertex = used.binary_search(vertex).unwrap_or(0) as u32;
        }
        self.pick = Some(used);
    }
}

/// The vertices of triangles, each once, of `count` in all.
fn vertices_of(triangles: &[[u32; 3]], count: usize) -> Vec<u32> {
    // Few triangles may use a part of a long list, many most of it.
    const SPARSE: usize = 16;
    if triangles.len() < count / SPARSE {
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        return used;
    }
    let mut is_used = vec![false; count];
    triangles.iter().flatten().for_each(|vertex| is_used[*vertex as usize] = true);
    (0..count as u32).filter(|vertex| is_used[*vertex as usize]).collect()
}

/// Clamps texture coordinates and colours that are out of range.
pub(super) fn clean(mesh: &mut Mesh, notes: &mut Notes) {
    let mut clamped = false;
    for uv in mesh.uvs.iter_mut().flatten() {
        clamped |= clamp(uv, f32::MIN, f32::MAX);
    }
    for color in &mut mesh.colors {
        clamped |= clamp(color, 0.0, 1.0);
    }
    if clamped {
        notes.fault("vertex colours or texture coordinates out of range were clamped".into());
    }
}

/// Brings values within bounds, NaN to zero; true if any was not.
fn clamp(values: &mut [f32], low: f32, high: f32) -> bool {
    let mut clamped = false;
    for value in values.iter_mut().filter(|value| !(**value >= low && **value <= high)) {
        *value = if value.is_nan() { 0.0 } else { value.clamp(low, high) };
        clamped = true;
    }
    clamped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(Mode::Strip, &[0, 1, 2, 3, 4]), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(Mode::Fan, &[9, 1, 2, 3]), [[1, 2, 9], [2, 3, 9]]);
        assert_eq!(triangles(Mode::List, &[0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert!(triangles(Mode::Fan, &[]).is_empty());
    }

    #[test]
    fn only_vertices_in_use_are_kept() {
        for count in [9, 900] {
            let mut primitive = Primitive { count, ..Primitive::default() };
            primitive.mesh.triangles = vec![[7, 2, 4], [4, 2, 8]];
            primitive.drop_unused_vertices();
            assert_eq!(primitive.mesh.triangles, [[2, 0, 1], [1, 0, 3]]);
            assert_eq!(primitive.pick, Some(vec![2, 4, 7, 8]));
        }
        let mut whole = Primitive { count: 3, ..Primitive::default() };
        whole.mesh.triangles = vec![[2, 1, 0]];
        whole.drop_unused_vertices();
        assert_eq!((whole.mesh.triangles.as_slice(), whole.pick), (&[[2, 1, 0]][..], None));
    }

    #[test]
    fn attributes_of_applications_are_no_faults() {
        assert!(["_ID", "POSITION", "TEXCOORD_7", "JOINTS_1"].into_iter().all(is_known));
        assert!(!["ID", "TEXCOORD", "TEXCOORD_", "COLOR_x", "position"].into_iter().any(is_known));
    }
}
