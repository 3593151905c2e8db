//! Names of frames, and which of them a machine renders.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A file name in which a run of `#` stands for the number of the frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    path: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern that a path is.
    ///
    /// # Errors
    /// [`Error::Usage`] if its name has no `#`, or several runs of them, or is no text.
    pub fn of(path: &Path) -> Result<Self> {
        let wrong = |what: &str| Error::Usage(format!("output '{}' {what}, as in frame_####.exr", path.display()));
        let name = path.file_name().and_then(|name| name.to_str()).ok_or_else(|| wrong("has no name"))?;
        let start = name.find('#').ok_or_else(|| wrong("needs #### for the number of the frame"))?;
        let after = name[start..].trim_start_matches('#');
        if after.contains('#') {
            return Err(wrong("has more than one place for the number of the frame"));
        }
        let (before, after) = (name[..start].to_owned(), after.to_owned());
        Ok(Self { path: path.to_owned(), digits: name.len() - before.len() - after.len(), before, after })
    }

    /// The file of a frame; numbers with more digits than there are `#` are written whole.
    pub fn file(&self, frame: u64) -> PathBuf {
        let Self { before, digits, after, .. } = self;
        self.path.with_file_name(format!("{before}{frame:0digits$}{after}"))
    }

    /// The file of the film of a frame in work.
    pub fn checkpoint(&self, frame: u64) -> PathBuf {
        self.file(frame).with_extension("film.exr")
    }

    /// The pattern as it was written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name as C's `printf` has it, for ffmpeg.
    pub fn printf(&self) -> String {
        let escaped = |text: &str| text.replace('%', "%%");
        format!("{}%0{}d{}", escaped(&self.before), self.digits, escaped(&self.after))
    }
}

/// Part `of` parts: every `of`-th frame, from the `part`-th on, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    part: u64,
    of: u64,
}

impl Part {
    /// Parses `2/4`.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        let part = numbers.filter(|(part, of)| (1..=*of).contains(part)).map(|(part, of)| Self { part, of });
        part.ok_or_else(|| "expected K/N with K from 1 to N, such as 2/4".into())
    }

    /// All frames.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Those of these frames that belong to it.
    pub fn of(self, frames: std::ops::Range<u64>) -> impl Iterator<Item = u64> {
        let step = usize::try_from(self.of).unwrap_or(usize::MAX);
        (frames.start.saturating_add(self.part - 1)..frames.end).step_by(step)
    }

    /// How many of so many frames belong to it.
    pub fn count(self, frames: u64) -> u64 {
        frames.saturating_sub(self.part - 1).div_ceil(self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_padded_and_never_cut() {
        let pattern = Pattern::of(Path::new("out/50%_##.exr")).expect("a pattern");
        assert_eq!(pattern.file(7), Path::new("out/50%_07.exr"));
        assert_eq!(pattern.file(1234), Path::new("out/50%_1234.exr"));
        assert_eq!(pattern.checkpoint(7), Path::new("out/50%_07.film.exr"));
        assert_eq!(pattern.printf(), "50%%_%02d.exr");
        for wrong in ["frame.exr", "a#b#.exr", "####/frame.exr", "/"] {
            assert!(matches!(Pattern::of(Path::new(wrong)), Err(Error::Usage(_))), "{wrong}");
        }
    }

    #[test]
    fn parts_are_all_frames_once() {
        let part = |text: &str| Part::parse(text).expect("a part");
        assert_eq!(Part::WHOLE.of(3..6).collect::<Vec<_>>(), [3, 4, 5]);
        let parts: Vec<Vec<u64>> = ["1/3", "2/3", "3/3"].map(|text| part(text).of(10..17).collect()).to_vec();
        assert_eq!(parts, [vec![10, 13, 16], vec![11, 14], vec![12, 15]]);
        for (text, count) in [("1/3", 3), ("2/3", 2), ("3/3", 2), ("9/9", 0), ("1/1", 7)] {
            assert_eq!(part(text).count(7), count, "{text}");
            assert_eq!(part(text).of(10..17).count() as u64, count, "{text}");
        }
        for wrong in ["", "1", "0/3", "4/3", "a/b", "1/0", "-1/3"] {
            assert!(Part::parse(wrong).is_err(), "{wrong}");
        }
    }
}
