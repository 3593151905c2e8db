//! What stands for KHR_draco_mesh_compression in a build without the feature `draco`.

use std::convert::Infallible;
use std::marker::PhantomData;

use super::document::Document;
use super::notes::{Notes, Outcome};
use super::part::Part;

/// There is none.
pub(super) struct Packed<'a>(Infallible, PhantomData<&'a ()>);

impl Packed<'_> {
    pub fn of(_: &Document, part: &Part, _: &mut Notes) -> Outcome<Self> {
        let place = &part.place;
        Err(format!("{place}: this build reads no Draco (feature `draco`); `gltf-transform copy IN OUT` unpacks it"))
    }

    pub fn count(&self) -> usize {
        match self.0 {}
    }

    pub fn triangles(&self) -> Vec<[u32; 3]> {
        match self.0 {}
    }

    pub fn values<const N: usize>(&self, _: &str, _: bool, _: f32) -> Outcome<Option<Vec<[f32; N]>>> {
        match self.0 {}
    }
}
