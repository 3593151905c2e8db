//! Where bytes come from: data URIs and files inside the scene's folder, nothing else.
//!
//! A scene file may come from anywhere, so it must not be able to name files outside its folder: absolute paths, `..`
//! beyond the folder, schemes such as `file:` or `http:`, and symbolic links that leave the folder are refused.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use super::notes::{Outcome, clip};

/// Reads the files a scene names.
pub(super) struct Folder {
    /// Canonical path of the scene's folder.
    root: PathBuf,
    /// Largest file to read, in bytes.
    max_bytes: u64,
}

impl Folder {
    /// The folder that holds `scene`.
    pub fn of(scene: &Path, max_bytes: u64) -> Outcome<Self> {
        let parent = match scene.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let root = parent.canonicalize().map_err(|e| format!("its folder cannot be found: {e}"))?;
        Ok(Self { root, max_bytes })
    }

    /// The bytes a URI stands for, the first `most` of a longer file.
    pub fn fetch(&self, uri: &str, most: u64) -> Outcome<Vec<u8>> {
        match scheme(uri) {
            Some(s) if s.eq_ignore_ascii_case("data") => data_uri(&uri[s.len() + 1..]),
            Some(s) => {
                Err(format!("scheme '{}' is refused: only data URIs and files beside the scene are read", clip(s)))
            }
            None => self.file(uri, most),
        }
    }

    /// The file that a URI names, if it names one of this folder that exists.
    pub fn file_of(&self, uri: &str) -> Option<PathBuf> {
        if scheme(uri).is_some() { None } else { self.find(uri).ok() }
    }

    fn file(&self, uri: &str, most: u64) -> Outcome<Vec<u8>> {
        let path = self.find(uri)?;
        read_start(&path, self.max_bytes, most).map_err(|cause| format!("file '{}' {cause}", clip(uri)))
    }

    /// The canonical path of a file in this folder. Some exporters leave percent signs of names as they are.
    fn find(&self, uri: &str) -> Outcome<PathBuf> {
        let decoded = percent_decode(uri)
            .and_then(|name| String::from_utf8(name).map_err(|_| format!("file name '{}' is not UTF-8", clip(uri))));
        let found = decoded.and_then(|name| self.named(&name));
        if found.is_err() && uri.contains('%') { self.named(uri).or(found) } else { found }
    }

    /// The canonical path of a file with this name; a backslash separates folders as on the systems that write it.
    fn named(&self, name: &str) -> Outcome<PathBuf> {
        let name = name.replace('\\', "/");
        if name.is_empty() || name.contains('\0') {
            return Err(format!("'{}' is not a file name", clip(&name)));
        }
        let relative = inside(Path::new(&name));
        let relative = relative.ok_or_else(|| format!("'{}' is outside the scene's folder", clip(&name)))?;
        let missing = |e| format!("file '{}' cannot be read: {e}", clip(&name));
        let path = self.root.join(relative).canonicalize().map_err(missing)?;
        if !path.starts_with(&self.root) {
            return Err(format!("'{}' leads outside the scene's folder", clip(&name)));
        }
        Ok(path)
    }
}

/// A relative path without `.` and `..`; `None` if it is absolute or leaves its folder on the way.
fn inside(path: &Path) -> Option<PathBuf> {
    let mut inside = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(name) => inside.push(name),
            Component::CurDir => {}
            Component::ParentDir if inside.pop() => {}
            _ => return None,
        }
    }
    Some(inside)
}

/// Reads a regular file of at most `max_bytes`. Devices and pipes, which could block for ever, are refused.
pub(super) fn read_limited(path: &Path, max_bytes: u64) -> Outcome<Vec<u8>> {
    read_start(path, max_bytes, u64::MAX)
}

/// Reads the first `most` bytes of a regular file of at most `max_bytes`.
fn read_start(path: &Path, max_bytes: u64, most: u64) -> Outcome<Vec<u8>> {
    let unreadable = |e| format!("cannot be read: {e}");
    let length = fs::metadata(path).map_err(unreadable)?;
    if !length.is_file() {
        return Err("is not a regular file".into());
    }
    if length.len().min(most) > max_bytes {
        return Err(format!("has {} bytes, more than the limit of {max_bytes}", length.len()));
    }
    let wanted = length.len().min(most);
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(wanted as usize).map_err(|_| format!("needs {wanted} bytes of memory: there are none"))?;
    // The file may grow after it was measured: the limit holds for what is read.
    File::open(path).map_err(unreadable)?.take(wanted).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// The scheme of a URI (RFC 3986, section 3.1), without the colon.
fn scheme(uri: &str) -> Option<&str> {
    let (scheme, _) = uri.split_once(':')?;
    let mut bytes = scheme.bytes();
    let valid = bytes.next()?.is_ascii_alphabetic()
        && bytes.all(|b| b.is_ascii_alphanumeric() || matches!(b, b'+' | b'-' | b'.'));
    valid.then_some(scheme)
}

/// The payload of a data URI (RFC 2397), `rest` being what follows `data:`.
fn data_uri(rest: &str) -> Outcome<Vec<u8>> {
    let (head, payload) = rest.split_once(',').ok_or("data URI without a comma")?;
    let base64 = head.rsplit(';').next().is_some_and(|s| s.trim().eq_ignore_ascii_case("base64"));
    match base64 {
        // `+`, `/` and `=` may be encoded (RFC 3986, section 2.1).
        true if payload.contains('%') => base64_decode(&percent_decode(payload)?),
        true => base64_decode(payload.as_bytes()),
        false => percent_decode(payload),
    }
}

/// Replaces `%XX`; anything else after a percent sign is an error.
fn percent_decode(text: &str) -> Outcome<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let (byte, tail) = match (first, tail) {
            (b'%', [high, low, tail @ ..]) => match (hex(*high), hex(*low)) {
                (Some(high), Some(low)) => (16 * high + low, tail),
                _ => return Err(format!("bad percent sequence in '{}'", clip(text))),
            },
            (b'%', _) => return Err(format!("cut percent sequence in '{}'", clip(text))),
            (byte, tail) => (byte, tail),
        };
        bytes.push(byte);
        rest = tail;
    }
    Ok(bytes)
}

fn hex(digit: u8) -> Option<u8> {
    (digit as char).to_digit(16).map(|d| d as u8)
}

/// Base64 (RFC 4648, section 4), padding optional, in lines or not.
fn base64_decode(text: &[u8]) -> Outcome<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut digits, mut padded) = (0u32, 0, false);
    for &digit in text.iter().filter(|digit| !digit.is_ascii_whitespace()) {
        if digit == b'=' {
            padded = true;
            continue;
        }
        let value = base64_digit(digit).filter(|_| !padded);
        bits = bits << 6 | u32::from(value.ok_or("base64 data holds a character that is not base64")?);
        digits += 1;
        if digits == 4 {
            bytes.extend_from_slice(&bits.to_be_bytes()[1..]);
            (bits, digits) = (0, 0);
        }
    }
    match digits {
        1 => return Err("base64 data is cut".into()),
        2 | 3 => bytes.extend_from_slice(&(bits << (6 * (4 - digits))).to_be_bytes()[1..digits]),
        _ => {}
    }
    Ok(bytes)
}

fn base64_digit(digit: u8) -> Option<u8> {
    match digit {
        b'A'..=b'Z' => Some(digit - b'A'),
        b'a'..=b'z' => Some(digit - b'a' + 26),
        b'0'..=b'9' => Some(digit - b'0' + 52),
        b'+' | b'-' => Some(62),
        b'/' | b'_' => Some(63),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_rfc_4648() {
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(base64_decode(text.as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64_decode(b"Zm9v\r\nYm Fy").unwrap(), b"foobar");
        for text in [&b"Zm9vY"[..], b"Zm9!", b"Z=g=", b"Zg==Zg=="] {
            assert!(base64_decode(text).is_err());
        }
    }

    #[test]
    fn percent_sequences() {
        assert_eq!(percent_decode("a%20b%C3%A4").unwrap(), "a b\u{e4}".as_bytes());
        assert!(percent_decode("%").is_err() && percent_decode("%4").is_err() && percent_decode("%G0").is_err());
    }

    #[test]
    fn data_uris() {
        assert_eq!(data_uri("application/octet-stream;base64,Zm8=").unwrap(), b"fo");
        assert_eq!(data_uri("application/octet-stream;base64,Zg%3D%3d").unwrap(), b"f");
        assert_eq!(data_uri(",a%20b").unwrap(), b"a b");
        assert!(data_uri("application/octet-stream;base64").is_err());
    }

    #[test]
    fn only_files_of_the_folder() {
        let outer = tempfile::tempdir().unwrap();
        let inner = outer.path().join("scene");
        fs::create_dir_all(inner.join("sub")).unwrap();
        fs::write(outer.path().join("secret"), "s").unwrap();
        fs::write(inner.join("sub/a b"), "ok").unwrap();
        fs::write(inner.join("50%.bin"), "half").unwrap();
        let folder = Folder::of(&inner.join("x.gltf"), 10).unwrap();
        let fetch = |uri: &str| folder.fetch(uri, 10);
        for uri in ["sub/a%20b", "./sub/a b", "sub/../sub/a b", "none/../sub/a b", "sub\\a b", "sub//a%20b"] {
            assert_eq!(fetch(uri).unwrap(), b"ok", "{uri}");
        }
        assert_eq!(fetch("50%.bin").unwrap(), b"half");
        assert_eq!(folder.fetch("50%.bin", 2).unwrap(), b"ha");
        assert!(folder.file_of("50%25.bin").is_some() && folder.file_of("data:,").is_none());
        let absolute = outer.path().join("secret");
        let absolute = absolute.to_str().unwrap();
        let file_uri = format!("file://{absolute}");
        let drive = "C:\\secret";
        for uri in [
            "../secret",
            "sub/../../secret",
            "sub\\..\\..\\secret",
            "%2e%2e/secret",
            absolute,
            &file_uri,
            "http://x/y",
            drive,
            "",
            "%FF",
            "sub",
        ] {
            assert!(fetch(uri).is_err(), "{uri}");
        }
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(outer.path().join("secret"), inner.join("link")).unwrap();
            assert!(fetch("link").unwrap_err().contains("outside"));
        }
        fs::write(inner.join("big"), [0; 11]).unwrap();
        assert!(folder.fetch("big", 20).unwrap_err().contains("limit"));
    }
}
