//! The pipeline cache on disk: checked when read, replaced as a whole when written.
//!
//! Layout, little-endian: magic `nphcache`, vendor, device and driver version as u32, the driver's cache UUID, length
//! and FNV-1a checksum of the data as u64, then the data as vkGetPipelineCacheData gave it. Anything unexpected is
//! treated as an empty cache: the file is only ever a saving of time.

use super::limits::Identity;
use std::io::Write;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"nphcache";
/// Header of our file: magic, three u32, UUID, two u64.
const HEADER_BYTES: usize = 8 + 12 + 16 + 16;
/// VkPipelineCacheHeaderVersionOne: size, version, vendor, device, UUID.
const VULKAN_HEADER_BYTES: usize = 32;
/// More than any cache of this crate's kernels; a larger file is not ours.
const MAX_BYTES: u64 = 256 << 20;

/// The folder for caches: `$XDG_CACHE_HOME/nephroid`, else `$HOME/.cache/nephroid`; none if neither is an absolute
/// path.
pub fn default_cache_dir() -> Option<PathBuf> {
    let folder = |variable: &str| std::env::var_os(variable).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = folder("XDG_CACHE_HOME").or_else(|| folder("HOME").map(|home| home.join(".cache")));
    base.map(|base| base.join("nephroid"))
}

/// The cache file of one device and driver.
pub(super) struct CacheFile {
    path: PathBuf,
    identity: Identity,
}

impl CacheFile {
    pub fn new(folder: &Path, identity: Identity) -> Self {
        let uuid: String = identity.uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let name = format!("pipelines-{:08x}-{:08x}-{uuid}.bin", identity.vendor, identity.device);
        Self { path: folder.join(name), identity }
    }

    /// The data, or nothing if there is no sound file for this device and driver.
    pub fn load(&self) -> Vec<u8> {
        let short = std::fs::metadata(&self.path).is_ok_and(|meta| meta.is_file() && meta.len() <= MAX_BYTES);
        let bytes = if short { std::fs::read(&self.path).unwrap_or_default() } else { Vec::new() };
        decode(&bytes, &self.identity).map(<[u8]>::to_vec).unwrap_or_default()
    }

    /// Replaces the file. Failures are ignored: the next start is slower, nothing else.
    pub fn store(&self, data: &[u8]) {
        let _ = self.try_store(data);
    }

    fn try_store(&self, data: &[u8]) -> std::io::Result<()> {
        let folder = self.path.parent().ok_or(std::io::ErrorKind::NotFound)?;
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(&encode(data, &self.identity))?;
        file.persist(&self.path)?;
        Ok(())
    }
}

fn header(data: &[u8], identity: &Identity) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    for word in [identity.vendor, identity.device, identity.driver_version] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(identity.uuid);
    bytes.extend((data.len() as u64).to_le_bytes());
    bytes.extend(checksum(data).to_le_bytes());
    bytes
}

fn encode(data: &[u8], identity: &Identity) -> Vec<u8> {
    let mut bytes = header(data, identity);
    bytes.extend(data);
    bytes
}

/// The data inside `bytes` if magic, identity, length and checksum agree and Vulkan's own header names this device.
fn decode<'a>(bytes: &'a [u8], identity: &Identity) -> Option<&'a [u8]> {
    let data = bytes.get(HEADER_BYTES..)?;
    let vulkan = data.get(..VULKAN_HEADER_BYTES)?;
    let word = |at: usize| u32::from_le_bytes([vulkan[at], vulkan[at + 1], vulkan[at + 2], vulkan[at + 3]]);
    let sound = bytes[..HEADER_BYTES] == header(data, identity)[..]
        && word(0) as usize == VULKAN_HEADER_BYTES
        && word(4) == 1
        && word(8) == identity.vendor
        && word(12) == identity.device
        && vulkan[16..] == identity.uuid;
    sound.then_some(data)
}

/// FNV-1a, 64 bits: finds accidents, not attacks (who can write the cache folder owns the account anyway).
fn checksum(data: &[u8]) -> u64 {
    data.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: Identity = Identity { vendor: 0x10005, device: 3, driver_version: 7, uuid: [9; 16] };

    fn data() -> Vec<u8> {
        let mut data = Vec::new();
        for word in [32u32, 1, IDENTITY.vendor, IDENTITY.device] {
            data.extend(word.to_le_bytes());
        }
        data.extend(IDENTITY.uuid);
        data.extend([1, 2, 3, 4, 5]);
        data
    }

    #[test]
    fn what_was_stored_is_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let file = CacheFile::new(&folder.path().join("deep/er"), IDENTITY);
        assert!(file.load().is_empty());
        file.store(&data());
        assert_eq!(file.load(), data());
        file.store(&data()[..32]);
        assert_eq!(file.load(), data()[..32]);
        assert_eq!(std::fs::read_dir(folder.path().join("deep/er")).unwrap().count(), 1, "temporary file left");
    }

    #[test]
    fn every_damaged_byte_and_every_cut_is_noticed() {
        let sound = encode(&data(), &IDENTITY);
        assert!(decode(&sound, &IDENTITY).is_some());
        for at in 0..sound.len() {
            let mut bad = sound.clone();
            bad[at] ^= 0x40;
            assert!(decode(&bad, &IDENTITY).is_none(), "byte {at} damaged unnoticed");
            assert!(decode(&sound[..at], &IDENTITY).is_none(), "cut at {at} unnoticed");
        }
    }

    #[test]
    fn another_device_or_driver_does_not_fit() {
        let sound = encode(&data(), &IDENTITY);
        assert!(decode(&sound, &Identity { driver_version: 8, ..IDENTITY }).is_none());
        // A file that is ours in name but holds another device's data.
        let other = Identity { device: 4, ..IDENTITY };
        assert!(decode(&encode(&data(), &other), &other).is_none());
    }
}
