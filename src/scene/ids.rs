//! Names of the parts of a scene: positions in its lists.
//!
//! An id stays what it is for the life of its scene: nothing is ever removed from a list, and an update changes parts
//! in place. An instance that shall vanish is made invisible.

macro_rules! ids {
    ($($name:ident of $list:literal),* $(,)?) => {$(
        #[doc = concat!("Position in [`Scene::", $list, "`](super::Scene#structfield.", $list, ").")]
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the part at this place of its list.
            ///
            /// # Panics
            /// If the place is beyond 2^32 - 1, which no list reaches.
            pub fn at(index: usize) -> Self {
                Self(u32::try_from(index).expect("lists of a scene are shorter than 2^32"))
            }

            /// The place in the list.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    MeshId of "meshes",
    InstanceId of "instances",
    MaterialId of "materials",
    LightId of "lights",
    CameraId of "cameras",
}
