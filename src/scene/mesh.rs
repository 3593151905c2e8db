//! Surfaces and where they stand.

use std::sync::Arc;

use super::{MaterialId, MeshId, Transform};

/// Triangles of one material in a space of their own. Instances place them in the world.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Name, for people.
    pub name: Arc<str>,
    /// Vertex positions in scene units.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals, one per vertex. Empty: every triangle is flat.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangents with the handedness (1 or -1) in w, one per vertex. Empty: normal maps follow the texture
    /// coordinates.
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinate sets 0 and 1; each is empty (all zero) or has one entry per vertex.
    pub uvs: [Vec<[f32; 2]>; 2],
    /// Linear colours (RGBA, 0 to 1) that multiply the base colour, one per vertex. Empty: white.
    pub colors: Vec<[f32; 4]>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// What all its triangles are made of.
    pub material: MaterialId,
}

/// A mesh in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// Name, for people; instances of one node of a file share it.
    pub name: Arc<str>,
    /// The mesh that is shown.
    pub mesh: MeshId,
    /// From the mesh's space to the world. `None`: the mesh is in world space, and its vertices and triangles are used
    /// as they are, to the bit. Through a transform, triangles that lose their area are left out and normals are made
    /// unit again.
    pub transform: Option<Transform>,
    /// Whether it is in the scene at all: what is not visible casts no shadow and gives no light.
    pub visible: bool,
}

impl Instance {
    /// A visible instance of a mesh that is in world space.
    pub fn of(mesh: MeshId) -> Self {
        Self { name: Arc::default(), mesh, transform: None, visible: true }
    }

    /// The same instance, placed by a transform.
    pub fn at(self, transform: Transform) -> Self {
        Self { transform: Some(transform), ..self }
    }

    /// The same instance under a name.
    pub fn named(self, name: impl Into<Arc<str>>) -> Self {
        Self { name: name.into(), ..self }
    }
}
