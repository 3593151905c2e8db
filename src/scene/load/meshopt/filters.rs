//! What is done to attributes after they are unpacked (appendix B of KHR_meshopt_compression).

use super::Filter;

/// Applies a filter to elements of `stride` bytes, in place.
pub(super) fn apply(filter: Filter, stride: usize, bytes: &mut [u8]) {
    match (filter, stride) {
        (Filter::None, _) => {}
        (Filter::Exponential, _) => bytes.chunks_exact_mut(4).for_each(exponential),
        (Filter::Octahedral, 4) => bytes.chunks_exact_mut(4).for_each(|b| signed_bytes(b, |v| octahedral(v, 127.0))),
        (Filter::Octahedral, _) => bytes.chunks_exact_mut(8).for_each(|b| signed_shorts(b, |v| octahedral(v, 32767.0))),
        (Filter::Quaternion, _) => bytes.chunks_exact_mut(8).for_each(|b| signed_shorts(b, quaternion)),
        (Filter::Color, 4) => bytes.chunks_exact_mut(4).for_each(color_bytes),
        (Filter::Color, _) => bytes.chunks_exact_mut(8).for_each(color_shorts),
    }
}

fn signed_bytes(bytes: &mut [u8], decode: impl Fn([i32; 4]) -> [i32; 4]) {
    let decoded = decode(std::array::from_fn(|k| i32::from(bytes[k] as i8)));
    bytes.iter_mut().zip(decoded).for_each(|(byte, value)| *byte = value as u8);
}

fn shorts(bytes: &[u8]) -> [u16; 4] {
    std::array::from_fn(|k| u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]))
}

fn put_shorts(bytes: &mut [u8], values: [i32; 4]) {
    let values = values.into_iter().flat_map(|value| (value as u16).to_le_bytes());
    bytes.iter_mut().zip(values).for_each(|(byte, value)| *byte = value);
}

fn signed_shorts(bytes: &mut [u8], decode: impl Fn([i32; 4]) -> [i32; 4]) {
    let decoded = decode(shorts(bytes).map(|value| i32::from(value as i16)));
    put_shorts(bytes, decoded);
}

/// A unit vector from its place on an octahedron; the last component stays as it is.
fn octahedral([x, y, one, rest]: [i32; 4], largest: f32) -> [i32; 4] {
    let one = one as f32;
    let (mut x, mut y) = (x as f32 / one, y as f32 / one);
    let z = 1.0 - x.abs() - y.abs();
    // The lower half is folded outwards.
    let fold = z.min(0.0);
    x -= fold.copysign(x);
    y -= fold.copysign(y);
    let scale = largest / (x * x + y * y + z * z).sqrt();
    // Casts of what is not finite or out of range saturate.
    [(x * scale).round() as i32, (y * scale).round() as i32, (z * scale).round() as i32, rest]
}

/// A unit quaternion without its largest component, whose place is in the two lowest bits of the last number.
fn quaternion([x, y, z, last]: [i32; 4]) -> [i32; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / (last | 3) as f32;
    let small = [x, y, z].map(|value| value as f32 * scale);
    let largest = (1.0 - small.iter().map(|value| value * value).sum::<f32>()).max(0.0).sqrt();
    let mut result = [0; 4];
    let place = last as usize & 3;
    for (k, value) in [largest].into_iter().chain(small).enumerate() {
        result[(place + k) % 4] = (value * 32767.0).round() as i32;
    }
    result
}

/// A float as 24 bits times a power of two.
fn exponential(bytes: &mut [u8]) {
    let value = i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let (exponent, mantissa) = (value >> 24, (value << 8) >> 8);
    // Exact in double precision; beyond single precision it becomes infinite or zero.
    let float = (2.0_f64.powi(exponent) * f64::from(mantissa)) as f32;
    bytes.copy_from_slice(&float.to_le_bytes());
}

/// Red, green, blue and alpha up to `largest` from luma, two differences and alpha, whose highest bit tells the scale.
fn color([y, co, cg, alpha]: [i32; 4], largest: f32) -> [i32; 4] {
    let bits = 32 - (alpha as u32).leading_zeros();
    let all = (1_i64 << bits) as f32 - 1.0;
    let kept = alpha & ((1_i64 << bits.saturating_sub(1)) - 1) as i32;
    let alpha = kept << 1 | kept & 1;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|value| (value as f32 * (largest / all)).round() as i32)
}

fn color_bytes(bytes: &mut [u8]) {
    let signed = |byte: u8| i32::from(byte as i8);
    let decoded = color([bytes[0].into(), signed(bytes[1]), signed(bytes[2]), bytes[3].into()], 255.0);
    bytes.iter_mut().zip(decoded).for_each(|(byte, value)| *byte = value as u8);
}

fn color_shorts(bytes: &mut [u8]) {
    let [y, co, cg, alpha] = shorts(bytes);
    let signed = |value: u16| i32::from(value as i16);
    put_shorts(bytes, color([y.into(), signed(co), signed(cg), alpha.into()], 65535.0));
}
