//! A film of all frames, made by the program ffmpeg.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::pattern::Pattern;
use crate::error::{Error, Result, printable};

/// A film that is to be written.
#[derive(Debug)]
pub struct Movie {
    path: PathBuf,
    /// Its frames, which stay: they are what is gone on with.
    pub frames: Pattern,
}

impl Movie {
    /// Whether a file name is that of a film.
    pub fn is_named(path: &Path) -> bool {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        matches!(extension.as_deref(), Some("mp4" | "webm"))
    }

    /// A film in `path`, whose frames are pictures in a folder beside it.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no ffmpeg, [`Error::Io`] if the folder cannot be made.
    pub fn of(path: &Path) -> Result<Self> {
        let found = Command::new(PROGRAM).arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).status();
        if !found.is_ok_and(|status| status.success()) {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let what = format!("'{}' needs the program {PROGRAM}, which is not there", path.display());
            return Err(Error::Usage(format!("{what}; write frames instead: -o {stem}_####.png")));
        }
        let folder = path.with_extension("frames");
        std::fs::create_dir_all(&folder).map_err(|source| Error::io(&folder, "create", source))?;
        Ok(Self { path: path.to_owned(), frames: Pattern::of(&folder.join("frame_######.png"))? })
    }

    /// Makes the film of `count` frames from `first` on.
    ///
    /// # Errors
    /// [`Error::Io`] with what ffmpeg says if it fails; a film that was there is then untouched.
    pub fn write(&self, (first, count): (u64, u64), fps: f64) -> Result<()> {
        let failed = |source| Error::io(&self.path, "write", source);
        // ffmpeg knows the format by the extension.
        let extension = self.path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let unfinished = self.path.with_extension(format!("unfinished.{extension}"));
        let pictures = self.frames.path().with_file_name(self.frames.printf());
        let codec: &[&str] = match extension.to_ascii_lowercase().as_str() {
            "webm" => &["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "24"],
            _ => &["-c:v", "libx264", "-crf", "16", "-movflags", "+faststart"],
        };
        let mut command = Command::new(PROGRAM);
        command.args(["-hide_banner", "-loglevel", "error", "-nostdin", "-y"]);
        command.args(["-framerate", &fps.to_string(), "-start_number", &first.to_string(), "-i"]).arg(&pictures);
        command.args(["-frames:v", &count.to_string()]).args(codec);
        // These formats have half as many colours as pixels in either direction: sides are made even.
        command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]).arg(&unfinished);
        let output = command.stdin(Stdio::null()).output().map_err(failed)?;
        if !output.status.success() {
            let _ = std::fs::remove_file(&unfinished);
            let said = String::from_utf8_lossy(&output.stderr);
            let said = printable(said.lines().next().unwrap_or("nothing"));
            return Err(failed(std::io::Error::other(format!("{PROGRAM} failed and said: {said}"))));
        }
        std::fs::rename(&unfinished, &self.path).map_err(failed)
    }

    /// Where it goes.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

const PROGRAM: &str = "ffmpeg";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_are_known_by_their_names() {
        assert!(Movie::is_named(Path::new("a.MP4")) && Movie::is_named(Path::new("b/c.webm")));
        assert!(!["a.exr", "mp4", "a_####.png", ""].iter().any(|name| Movie::is_named(Path::new(name))));
    }
}
