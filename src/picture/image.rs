//! A finished picture: layers of linear 32-bit floats, rows from the top.

/// What the numbers of a layer mean, and so how its channels are called in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Linear Rec.709 colour: channels R, G, B.
    Rgb,
    /// A direction or position in world space: channels X, Y, Z.
    Vector,
    /// One number, for example a depth in scene units: channel Z.
    Scalar,
}

impl Channels {
    /// The channel names, in the order in which [`Layer::data`] interleaves them.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Rgb => &["R", "G", "B"],
            Self::Vector => &["X", "Y", "Z"],
            Self::Scalar => &["Z"],
        }
    }

    /// Numbers per pixel: 1 or 3.
    pub fn count(self) -> usize {
        self.names().len()
    }
}

/// One layer of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Empty for the beauty layer; otherwise `albedo`, `normal`, `depth`, `direct`, `indirect`, `caustic`, `error`.
    pub name: String,
    /// Meaning of the numbers.
    pub channels: Channels,
    /// `width * height * channels.count()` numbers: pixels row by row from the top left, channels interleaved.
    pub data: Vec<f32>,
}

/// A picture: layers of one size.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The layers; names are unique.
    pub layers: Vec<Layer>,
}

impl Picture {
    /// A picture without layers.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, layers: Vec::new() }
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Adds a layer.
    ///
    /// # Panics
    /// If `data` does not have `pixel_count() * channels.count()` numbers or the name is taken: both are mistakes of
    /// the program, never of its input.
    pub fn push(&mut self, name: &str, channels: Channels, data: Vec<f32>) {
        assert_eq!(data.len(), self.pixel_count() * channels.count(), "numbers in layer '{name}'");
        assert!(self.layer(name).is_none(), "layer '{name}' exists already");
        self.layers.push(Layer { name: name.to_owned(), channels, data });
    }

    /// The layer of this name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// The beauty layer: the one without a name, if it holds colours.
    pub fn beauty(&self) -> Option<&Layer> {
        self.layer("").filter(|layer| layer.channels == Channels::Rgb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_found_by_name() {
        let mut picture = Picture::new(2, 1);
        picture.push("depth", Channels::Scalar, vec![1.0, 2.0]);
        assert!(picture.beauty().is_none());
        picture.push("", Channels::Rgb, vec![0.5; 6]);
        assert_eq!(picture.beauty().map(|layer| layer.data.len()), Some(6));
        assert_eq!(picture.layer("depth").map(|layer| layer.channels.count()), Some(1));
        assert!(picture.layer("normal").is_none());
    }

    #[test]
    #[should_panic(expected = "numbers in layer 'albedo'")]
    fn a_layer_of_the_wrong_size_is_a_mistake() {
        Picture::new(2, 2).push("albedo", Channels::Rgb, vec![0.0; 4]);
    }
}
