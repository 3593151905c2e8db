//! The text and the bytes of a .gltf or .glb file.

use std::borrow::Cow;

use super::notes::{Notes, Outcome};

/// A file taken apart.
pub(super) struct Container<'a> {
    pub json: Cow<'a, str>,
    /// The binary chunk of a .glb file.
    pub blob: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Takes a file apart; a .gltf file is text only.
    pub fn split(bytes: &'a [u8], notes: &mut Notes) -> Outcome<Self> {
        let (json, blob) = if bytes.starts_with(b"glTF") { split_glb(bytes, notes)? } else { (bytes, None) };
        Ok(Self { json: text(json, notes), blob })
    }
}

/// The text without a byte order mark before it and without NUL bytes after it, which some exporters pad with.
fn text<'a>(bytes: &'a [u8], notes: &mut Notes) -> Cow<'a, str> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let end = bytes.iter().rposition(|byte| !matches!(byte, 0 | b' ' | b'\t' | b'\r' | b'\n')).map_or(0, |at| at + 1);
    if bytes[end..].contains(&0) {
        notes.fault("its JSON is padded with NUL bytes instead of spaces".into());
    }
    let text = String::from_utf8_lossy(&bytes[..end]);
    if matches!(text, Cow::Owned(_)) {
        notes.fault("its JSON is not UTF-8: characters were replaced".into());
    }
    text
}

type Chunks<'a> = (&'a [u8], Option<&'a [u8]>);

/// The JSON and BIN chunks of a binary glTF file (glTF 2.0, section 4.4). Where the length in the header fits no end of
/// a chunk, that of the file is tried.
fn split_glb<'a>(bytes: &'a [u8], notes: &mut Notes) -> Outcome<Chunks<'a>> {
    let (Some(version), Some(announced)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err("the GLB header is cut".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version} is not supported, only 2"));
    }
    if let Some(Ok(found)) = bytes.get(..announced as usize).map(chunks) {
        return Ok(found);
    }
    if announced as usize == bytes.len() {
        return chunks(bytes);
    }
    let wrong = format!("the GLB header announces {announced} bytes, the file has {}", bytes.len());
    let found = chunks(bytes).map_err(|cause| format!("{wrong}: {cause}"))?;
    notes.fault(wrong);
    Ok(found)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// The first two chunks that are known, where all chunks together fill the file.
fn chunks(bytes: &[u8]) -> Outcome<Chunks<'_>> {
    let (mut json, mut blob) = (None, None);
    let mut at = 12;
    for number in 0.. {
        if at >= bytes.len() {
            break;
        }
        let (Some(size), Some(kind)) = (word(bytes, at), bytes.get(at + 4..at + 8)) else {
            return Err("a GLB chunk header is cut".into());
        };
        let left = bytes.len() - at - 8;
        let Some(content) = bytes[at + 8..].get(..size as usize) else {
            return Err(format!("GLB chunk {number} announces {size} bytes, {left} are left"));
        };
        match (number, kind) {
            (0, b"JSON") => json = Some(content),
            (0, _) => break,
            // Chunks of unknown kind must be ignored.
            (_, b"BIN\0") if blob.is_none() => blob = Some(content),
            _ => {}
        }
        at += 8 + size as usize;
    }
    json.map(|json| (json, blob)).ok_or_else(|| "the first GLB chunk is not JSON".into())
}
