//! KHR_texture_basisu: pictures in KTX 2, packed by Basis Universal.

use image::DynamicImage;

use super::notes::{Outcome, clip};

/// The first bytes of a KTX 2 file.
const MAGIC: &[u8] = b"\xABKTX 20\xBB\r\n\x1A\n";

pub(super) fn is_ktx(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Bytes of a block of 4 x 4 texels in what is packed further, at most.
const BLOCK_BYTES: u64 = 16;
/// Largest side of a picture, in texels.
const MOST_SIDE: u32 = 1 << 14;
/// Where the index of levels begins, and the bytes of one of them.
const LEVELS: usize = 80;
const LEVEL_BYTES: usize = 24;

/// Width and height of a picture whose header is sound (KTX 2.0, section 3): one layer and face, all parts inside of
/// the file, no level longer than its texels can be. The decoder believes these numbers.
pub(super) fn size(bytes: &[u8]) -> Outcome<[u32; 2]> {
    check(bytes).ok_or_else(|| "KTX: the header is damaged, or not that of one flat picture".into())
}

fn check(bytes: &[u8]) -> Option<[u32; 2]> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let long = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let inside = |offset: u64, length: u64| offset.checked_add(length).filter(|end| *end <= bytes.len() as u64);
    let [width, height, depth, layers, faces, levels] =
        [word(20)?, word(24)?, word(28)?, word(32)?, word(36)?, word(40)?];
    let sides = 1..=MOST_SIDE;
    let is_flat = depth == 0 && layers <= 1 && faces == 1 && levels <= MOST_SIDE.ilog2() + 1;
    if !is_flat || !sides.contains(&width) || !sides.contains(&height) {
        return None;
    }
    let most = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) * BLOCK_BYTES;
    for level in 0..levels.max(1) as usize {
        let at = LEVELS + LEVEL_BYTES * level;
        inside(long(at)?, long(at + 8)?)?;
        long(at + 16).filter(|unpacked| *unpacked <= most)?;
    }
    inside(word(48)?.into(), word(52)?.into())?;
    inside(word(56)?.into(), word(60)?.into())?;
    inside(long(64)?, long(72)?)?;
    Some([width, height])
}

/// The largest level as RGBA.
#[cfg(feature = "basisu")]
pub(super) fn decode(bytes: &[u8]) -> Outcome<DynamicImage> {
    use basisu::{DecodeFlags, TargetFormat, Transcoder};
    let [width, height] = size(bytes)?;
    let damaged = |cause: basisu::Error| format!("KTX: {}", clip(&format!("{cause:?}")));
    let source = Transcoder::new(bytes).map_err(damaged)?;
    if !source.supports(TargetFormat::Rgba32) {
        return Err("KTX: only pictures of low dynamic range are read".into());
    }
    let texels = source.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(damaged)?;
    let image = image::RgbaImage::from_raw(width, height, texels);
    image.map(DynamicImage::ImageRgba8).ok_or_else(|| "KTX: its texels are not all there".into())
}

#[cfg(not(feature = "basisu"))]
pub(super) fn decode(_: &[u8]) -> Outcome<DynamicImage> {
    Err(clip("this build reads no KTX (feature `basisu`); `gltf-transform ktxdecompress IN OUT` makes PNG of it"))
}
