//! What both formats share: sizes within limits, colours, and what there is to tell.

use glam::Mat3;

use super::canvas::Canvas;
use super::color::{self, Chromaticities};
use crate::scene::load::Limits;

/// A result without the name of the file.
pub(super) type Outcome<T> = std::result::Result<T, String>;

/// Bytes of a map that every file may ask for: 4096 x 2048 texels.
const MAP_BYTES: u64 = 96 << 20;

/// Further bytes of the map for each byte of the file. Together they keep reading within what a file may cost.
const MAP_BYTES_PER_BYTE: u64 = 8;

/// A file on its way to a map.
pub(super) struct Reading<'a> {
    limits: &'a Limits,
    file_bytes: u64,
    notes: Vec<String>,
    faults: Vec<String>,
}

impl<'a> Reading<'a> {
    pub fn new(file_bytes: u64, limits: &'a Limits) -> Self {
        Self { limits, file_bytes, notes: Vec::new(), faults: Vec::new() }
    }

    /// Something chosen that the user should know, and that is not wrong.
    pub fn note(&mut self, text: String) {
        self.notes.push(text);
    }

    /// Something wrong that is read around.
    pub fn fault(&mut self, text: String) {
        // A damaged header could cause thousands.
        if self.faults.len() < 10 {
            self.faults.push(text);
        }
    }

    /// A black map of this size, reduced where the limits ask for it.
    pub fn canvas(&self, size: [u64; 2], to_rec_709: Option<Mat3>) -> Outcome<Canvas> {
        let ([width, height], side) = (size, u64::from(self.limits.image_side));
        if width == 0 || height == 0 || width > side || height > side {
            return Err(format!("{width} x {height} texels are out of bounds"));
        }
        let most = MAP_BYTES.saturating_add(self.file_bytes.saturating_mul(MAP_BYTES_PER_BYTE));
        Ok(Canvas::new(size, most.min(self.limits.image_bytes), to_rec_709))
    }

    /// The conversion from these primaries, told to the user; none if they are nonsense.
    pub fn conversion(&mut self, from: &Chromaticities) -> Option<Mat3> {
        let matrix = color::to_rec_709(from);
        match matrix {
            Some(_) => self.note(format!("environment: its chromaticities {from:?} are converted to Rec. 709")),
            None => self.fault(format!("environment: its chromaticities {from:?} span no colours, and are ignored")),
        }
        matrix
    }

    /// What there is to tell: an error under [`Limits::strict`] if anything was wrong.
    pub fn finish(mut self, clamped: u64, notes: Vec<String>) -> Outcome<Vec<String>> {
        if clamped > 0 {
            self.faults.push(format!("environment: {clamped} negative or non-finite value(s) were clamped"));
        }
        match self.faults.first() {
            Some(fault) if self.limits.strict => Err(fault.clone()),
            _ => Ok(self.faults.into_iter().chain(self.notes).chain(notes).collect()),
        }
    }
}

/// The start of a text from a file, without anything that a terminal could take for a command.
pub(super) fn shown(text: &str) -> String {
    text.trim().chars().take(40).map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}
