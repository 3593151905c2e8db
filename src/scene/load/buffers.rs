//! Buffers and views of them: read when something needs them, each once, and no more of a file than the buffer has.

use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::collections::HashMap;

use super::meshopt;
use super::notes::{Notes, Outcome};
use super::part::{List, Part};
use super::resolve::Folder;

/// Memory for what a file unpacks to, in bytes: this much, and a multiple of the bytes that were read.
const UNPACKED_BYTES: u64 = 96 << 20;
const UNPACKED_RATIO: u64 = 24;

/// A buffer of the file.
struct Buffer<'a> {
    /// Its bytes, `u64::MAX` where it does not say.
    length: u64,
    origin: Origin<'a>,
    /// What was read from its URI.
    contents: OnceCell<Outcome<Vec<u8>>>,
}

enum Origin<'a> {
    Blob(&'a [u8]),
    Uri(Cow<'a, str>),
    /// The buffer with the same URI.
    Like(usize),
    Nowhere,
}

/// Where the bytes of buffers come from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub folder: &'a Folder,
    /// The binary chunk of the file.
    pub blob: Option<&'a [u8]>,
    /// Bytes of the file itself.
    pub length: u64,
    /// Most bytes of all buffers together.
    pub most_bytes: u64,
}

/// All buffers and views.
pub(super) struct Buffers<'a> {
    source: Source<'a>,
    buffers: Vec<Buffer<'a>>,
    views: List<'a>,
    /// Views that are stored packed, by index.
    unpacked: Vec<OnceCell<Outcome<Vec<u8>>>>,
    /// Bytes of the file and of all other files so far.
    read: Cell<u64>,
    /// Bytes that were made of them.
    made: Cell<u64>,
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// The buffers of `root`.
    pub fn new(root: &Part<'a>, source: Source<'a>, notes: &mut Notes) -> Self {
        let list = List::of(root, "buffers", "buffer", notes);
        let mut known = HashMap::new();
        let mut buffers: Vec<Buffer<'a>> = Vec::with_capacity(list.len());
        for index in 0..list.len() {
            let part = notes.or_fault(list.part(index));
            let buffer =
                part.map_or_else(Buffer::missing, |part| Buffer::new((index, &part), source.blob, &mut known, notes));
            if let Origin::Like(first) = buffer.origin {
                buffers[first].length = buffers[first].length.max(buffer.length);
            }
            buffers.push(buffer);
        }
        let views = List::of(root, "bufferViews", "buffer view", notes);
        let unpacked = std::iter::repeat_with(OnceCell::new).take(views.len()).collect();
        Self { source, buffers, views, unpacked, read: source.length.into(), made: Cell::new(0) }
    }

    /// The URIs of all buffers.
    pub fn uris(&self) -> impl Iterator<Item = &str> {
        self.buffers.iter().filter_map(|buffer| match &buffer.origin {
            Origin::Uri(uri) => Some(uri.as_ref()),
            _ => None,
        })
    }

    /// Bytes that were read so far.
    pub fn bytes_read(&self) -> u64 {
        self.read.get()
    }

    /// Tells that `bytes` bytes of another file were read.
    pub fn add_read(&self, bytes: usize) {
        self.read.set(self.read.get().saturating_add(bytes as u64));
    }

    /// Bytes that may still be made of what was read.
    #[cfg(feature = "draco")]
    pub fn left(&self) -> u64 {
        UNPACKED_BYTES.saturating_add(self.read.get().saturating_mul(UNPACKED_RATIO)).saturating_sub(self.made.get())
    }

    /// Everything that was made is gone, but for unpacked views, which are kept within the same bounds.
    pub fn start_again(&self) {
        self.made.set(0);
    }

    /// Asks for memory that is made of what was read; fails where a small file asks for much.
    pub fn charge(&self, bytes: u64) -> Outcome<()> {
        let made = self.made.get().saturating_add(bytes);
        let most = UNPACKED_BYTES.saturating_add(self.read.get().saturating_mul(UNPACKED_RATIO));
        if made > most {
            return Err(format!(
                "it unpacks to more than {most} bytes, the limit for files of {} bytes",
                self.read.get()
            ));
        }
        self.made.set(made);
        Ok(())
    }

    /// A view; one that reaches beyond its buffer is cut.
    pub fn view(&self, index: usize, notes: &mut Notes) -> Outcome<View<'_>> {
        let part = self.views.part(index)?;
        let stride = part.count("byteStride")?;
        if stride == Some(0) {
            notes.fault(format!("{}: a stride of 0 bytes was ignored", part.place));
        }
        for name in meshopt::EXTENSIONS {
            if let Some(packed) = part.extension(name, notes) {
                let (bytes, stride) = self.unpacked(index, &packed)?;
                return Ok(View { bytes, stride: Some(stride) });
            }
        }
        let stride = stride.filter(|stride| *stride > 0).map(|stride| stride.try_into().unwrap_or(usize::MAX));
        Ok(View { bytes: self.slice(&part, notes)?, stride })
    }

    /// The bytes between `byteOffset` and `byteLength` of a buffer.
    fn slice(&self, part: &Part, notes: &mut Notes) -> Outcome<&[u8]> {
        let at = |cause: String| format!("{}: {cause}", part.place);
        let buffer = part.index("buffer")?.ok_or_else(|| at("it names no buffer".into()))?;
        let bytes = self.contents(buffer as usize, notes).map_err(at)?;
        let start = part.count("byteOffset")?.unwrap_or(0);
        let length = part.count("byteLength")?.ok_or_else(|| at("it has no length".into()))?;
        let beyond = || at("it reaches beyond its buffer".into());
        let rest = usize::try_from(start).ok().and_then(|start| bytes.get(start..)).ok_or_else(beyond)?;
        match usize::try_from(length).ok().and_then(|length| rest.get(..length)) {
            Some(bytes) => Ok(bytes),
            None if rest.is_empty() => Err(beyond()),
            None => {
                notes.fault(beyond());
                Ok(rest)
            }
        }
    }

    /// The unpacked bytes of a view and its stride.
    fn unpacked(&self, index: usize, packed: &Part) -> Outcome<(&[u8], usize)> {
        let at = |cause: String| format!("{}: {cause}", packed.place);
        let stream = meshopt::Stream::of(packed)?;
        let bytes = self.unpacked[index].get_or_init(|| {
            self.charge(stream.bytes()).map_err(at)?;
            // Where bytes are missing the stream ends too early, which is said.
            let bytes = self.slice(packed, &mut Notes::default())?;
            stream.unpack(bytes).map_err(at)
        });
        bytes.as_ref().map(|bytes| (bytes.as_slice(), stream.stride())).map_err(Clone::clone)
    }

    fn contents(&self, index: usize, notes: &mut Notes) -> Outcome<&[u8]> {
        let buffer = self.buffers.get(index).ok_or_else(|| format!("buffer {index} does not exist"))?;
        let at = |cause: String| format!("buffer {index}: {cause}");
        let bytes = match &buffer.origin {
            Origin::Blob(blob) if blob.len() as u64 > self.source.most_bytes => {
                return Err(at(format!("{} bytes, more than the limit of {}", blob.len(), self.source.most_bytes)));
            }
            Origin::Blob(blob) => *blob,
            Origin::Like(first) => self.contents(*first, notes)?,
            Origin::Nowhere => return Err(at("it has neither a URI nor a BIN chunk".into())),
            Origin::Uri(uri) => {
                let contents = buffer.contents.get_or_init(|| {
                    let bytes = self.read(uri, buffer.length).map_err(at)?;
                    notes.or_fault(buffer.complete(bytes.len()).map_err(at));
                    Ok(bytes)
                });
                contents.as_deref().map_err(Clone::clone)?
            }
        };
        Ok(&bytes[..bytes.len().min(usize::try_from(buffer.length).unwrap_or(usize::MAX))])
    }

    fn read(&self, uri: &str, length: u64) -> Outcome<Vec<u8>> {
        let most = self.source.most_bytes;
        let left = most.saturating_sub(self.read.get() - self.source.length);
        if length != WHOLE && length > left {
            return Err(format!("{length} bytes, more than the limit of {most} in all"));
        }
        let bytes = self.source.folder.fetch(uri, length.min(left))?;
        self.add_read(bytes.len());
        Ok(bytes)
    }
}

/// The length of a buffer that does not say how long it is.
const WHOLE: u64 = u64::MAX;

impl<'a> Buffer<'a> {
    fn missing() -> Self {
        Self { length: 0, origin: Origin::Nowhere, contents: OnceCell::new() }
    }

    /// Buffer `index`; `known` are the URIs of those before it.
    fn new(
        (index, part): (usize, &Part<'a>),
        blob: Option<&'a [u8]>,
        known: &mut HashMap<Cow<'a, str>, usize>,
        notes: &mut Notes,
    ) -> Self {
        let length = notes.or_fault(part.count("byteLength")).flatten().unwrap_or(WHOLE);
        let origin = match (part.text("uri", notes), blob) {
            (Some(uri), _) => match known.get(&uri) {
                Some(first) => Origin::Like(*first),
                None => {
                    known.insert(uri.clone(), index);
                    Origin::Uri(uri)
                }
            },
            (None, Some(blob)) if index == 0 => Origin::Blob(blob),
            (None, _) => Origin::Nowhere,
        };
        let buffer = Self { length, origin, contents: OnceCell::new() };
        let whole = match &buffer.origin {
            Origin::Nowhere if !is_placeholder(part) => Err("it has neither a URI nor a BIN chunk".into()),
            Origin::Blob(blob) => buffer.complete(blob.len()),
            _ => Ok(()),
        };
        notes.or_fault(whole.map_err(|cause| format!("buffer {index}: {cause}")));
        buffer
    }

    /// Whether it has all its bytes; fails with how many are missing.
    fn complete(&self, bytes: usize) -> Outcome<()> {
        let missing = self.length.saturating_sub(bytes as u64);
        if missing == 0 || self.length == WHOLE {
            return Ok(());
        }
        Err(format!("{missing} of {} bytes are missing", self.length))
    }
}

/// Whether a buffer only stands for what its views hold packed.
fn is_placeholder(part: &Part) -> bool {
    meshopt::EXTENSIONS.iter().any(|name| part.extension(name, &mut Notes::default()).is_some())
}
