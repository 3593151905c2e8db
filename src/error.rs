//! Typed errors: the call or file, the object, the cause.
//!
//! The library never prints, exits or panics on input; it returns an [`Error`]. An error names causes, and settings by
//! their fields. It never names flags of the command line, which adds them as advice.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

/// `Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can go wrong because of input or environment.
#[derive(Debug)]
pub enum Error {
    /// A request that makes no sense, in words. Exit code 1.
    Usage(String),
    /// A setting has a value that is not possible, or settings do not go together. Exit code 1.
    Setting {
        /// The fields at fault, by their names in `render::Settings` or `vk::DeviceOptions`.
        settings: &'static [&'static str],
        /// What is wrong, and what would be right.
        cause: String,
    },
    /// A scene, image or other input file is damaged, unsupported or out of bounds. Exit code 2.
    Scene {
        /// The file at fault.
        path: PathBuf,
        /// Object and cause, for example `accessor 3: 7 bytes missing`.
        what: String,
    },
    /// The operating system refused a file operation. Exit code 2.
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, as an infinitive: `read`, `create`.
        action: &'static str,
        /// The cause.
        source: std::io::Error,
    },
    /// No Vulkan loader, no device, or none that fits the choice. Exit code 3.
    NoDevice(String),
    /// The device lacks something that this scene needs. Exit code 3.
    MissingFeature {
        /// Device name.
        device: String,
        /// The feature, and what it is needed for.
        feature: String,
        /// The fields of `render::Settings` that ask for it; none where nothing can be rendered without it.
        settings: &'static [&'static str],
    },
    /// A Vulkan call failed. Exit code 4.
    Vulkan {
        /// The call, for example `vkQueueSubmit2`.
        call: &'static str,
        /// The object it was made for, for example a buffer's name.
        object: String,
        /// The `VkResult` code.
        code: i32,
    },
    /// The device was lost or did not answer in time. Exit code 4.
    DeviceLost {
        /// The last scope of the command graph known to have finished.
        last_finished_scope: String,
    },
    /// An allocation does not fit. Exit code 4.
    OutOfMemory {
        /// The object, for example `photon_hits`.
        object: String,
        /// Bytes asked for.
        bytes: u64,
        /// The limit that it exceeds.
        cause: MemoryCause,
    },
    /// The validation layers reported something. Exit code 4.
    Validation(Vec<String>),
    /// A measure of a comparison is above its limit. Exit code 5.
    Threshold {
        /// The measure, for example `relmse`.
        metric: &'static str,
        /// What it is: a number, or infinite where the picture is not finite.
        value: f64,
        /// What it may be at most.
        limit: f64,
    },
    /// Cases of the self-test failed. Exit code 5.
    Cases {
        /// How many.
        failed: usize,
        /// Of how many.
        all: usize,
    },
    /// The user interrupted; what was finished has been written. Exit code 130.
    Interrupted,
}

/// The limit that an allocation exceeds. All lengths are in bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MemoryCause {
    /// The device has no room for a single buffer of this length.
    BufferTooLong {
        /// The longest buffer that it can have.
        longest: u64,
    },
    /// The device's memory is full.
    DeviceFull {
        /// What is left of it.
        left: u64,
    },
    /// The allocator has no memory for a buffer.
    BufferRefused(String),
    /// The allocator has no memory for an image.
    ImageRefused(String),
    /// A kernel cannot see all of a buffer at once.
    BindingTooLong {
        /// What a kernel sees of a buffer at most.
        longest: u64,
    },
    /// A part of the scene is longer than what a kernel sees at once.
    SceneTooLarge {
        /// The part: `triangles`, `textures`.
        part: String,
        /// What a kernel sees of a buffer at most.
        longest: u64,
    },
    /// A pass stores more photons than the photon map can have.
    TooManyPhotons {
        /// The most that it can have.
        most: u64,
    },
    /// A buffer has more than 2^32 - 1 elements.
    TooManyElements,
}

impl fmt::Display for MemoryCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BufferTooLong { longest } => write!(f, "the largest single buffer is {longest} bytes"),
            Self::DeviceFull { left } => write!(f, "what is left of the device's memory is {left} bytes"),
            Self::BufferRefused(cause) | Self::ImageRefused(cause) => write!(f, "{cause}"),
            Self::BindingTooLong { longest } | Self::SceneTooLarge { longest, .. } => {
                write!(f, "a kernel sees at most {longest} bytes of a buffer on this device")
            }
            Self::TooManyPhotons { most } => write!(f, "a pass stores at most {most} photons on this device"),
            Self::TooManyElements => write!(f, "a buffer holds at most 2^32 - 1 elements"),
        }
    }
}

impl Error {
    /// An [`Error::Setting`] about these fields.
    pub fn setting(settings: &'static [&'static str], cause: impl Into<String>) -> Self {
        Self::Setting { settings, cause: cause.into() }
    }

    /// An [`Error::Scene`] about `path`.
    pub fn scene(path: impl AsRef<Path>, what: impl Into<String>) -> Self {
        Self::Scene { path: path.as_ref().to_owned(), what: what.into() }
    }

    /// An [`Error::Io`] about `path`.
    pub fn io(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_owned(), action, source }
    }

    /// The process exit code for this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Setting { .. } => 1,
            Self::Scene { .. } | Self::Io { .. } => 2,
            Self::NoDevice(_) | Self::MissingFeature { .. } => 3,
            Self::Vulkan { .. } | Self::DeviceLost { .. } | Self::OutOfMemory { .. } | Self::Validation(_) => 4,
            Self::Threshold { .. } | Self::Cases { .. } => 5,
            Self::Interrupted => 130,
        }
    }
}

/// Whether a character of a name can be printed: none that a terminal obeys, that breaks a line, or that hides or turns
/// the text around it (Unicode's formatting characters).
pub fn is_plain(c: char) -> bool {
    !c.is_control()
        && !matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// A name from a file as it can be printed in a line: other characters are written as `\u{1b}`.
pub fn escaped(name: &str) -> Cow<'_, str> {
    if name.chars().all(is_plain) {
        return Cow::Borrowed(name);
    }
    let one = |c: char| if is_plain(c) { c.to_string() } else { c.escape_unicode().to_string() };
    Cow::Owned(name.chars().map(one).collect())
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(what) => write!(f, "{what}"),
            Self::Setting { settings, cause } => write!(f, "{}: {cause}", settings.join(" and ")),
            Self::Scene { path, what } => write!(f, "{}: {}", shown(path), escaped(what)),
            Self::Io { path, action, source } => write!(f, "{}: cannot {action}: {source}", shown(path)),
            Self::NoDevice(what) => write!(f, "no usable Vulkan device: {what}"),
            Self::MissingFeature { device, feature, .. } => write!(f, "device '{device}' lacks {feature}"),
            Self::Vulkan { call, object, code } => write!(f, "{call} failed for '{object}' with VkResult {code}"),
            Self::DeviceLost { last_finished_scope } => {
                write!(f, "the device was lost; last finished scope: {last_finished_scope}")
            }
            Self::OutOfMemory { object, bytes, cause } => {
                write!(f, "'{object}' needs {bytes} bytes, more than this device gives: {cause}")
            }
            Self::Validation(messages) => {
                write!(f, "{} validation message(s), first: {}", messages.len(), messages.first().map_or("", |m| m))
            }
            Self::Threshold { metric, value, limit } => {
                write!(f, "{metric} is {value:.6e}, above the limit of {limit:e}")
            }
            Self::Cases { failed, all } => write!(f, "{failed} of {all} cases failed"),
            Self::Interrupted => write!(f, "interrupted"),
        }
    }
}

/// Lines of text as they can be printed: as [`escaped`], but lines stay lines.
#[cfg(feature = "cli")]
pub fn printable(text: &str) -> Cow<'_, str> {
    if text.chars().all(|c| is_plain(c) || matches!(c, '\n' | '\t')) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.split('\n').map(escaped).collect::<Vec<_>>().join("\n"))
}

fn shown(path: &Path) -> String {
    escaped(&path.to_string_lossy()).into_owned()
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_letters_and_lose_what_a_terminal_obeys() {
        for plain in ["k\u{e4}se \u{7acb}", "a-b_c.glb", "\u{2764}\u{fe0f}", ""] {
            assert_eq!(escaped(plain), plain);
        }
        assert_eq!(escaped("a\u{1b}[31m\nb\u{202e}c\u{9b}d\u{7f}"), "a\\u{1b}[31m\\u{a}b\\u{202e}c\\u{9b}d\\u{7f}");
        let error = Error::scene("a\nb.glb", "is damaged");
        assert_eq!(error.to_string(), "a\\u{a}b.glb: is damaged");
    }
}
