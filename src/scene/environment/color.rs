//! Colours of files as linear Rec. 709.

use glam::{DMat3, DVec3, Mat3};

/// CIE x and y of red, green, blue and white.
pub type Chromaticities = [f32; 8];

/// Rec. 709, white D65.
pub const REC_709: Chromaticities = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];

/// What Radiance means where it says nothing (`color.h`). Everyone shows it as Rec. 709.
pub const RADIANCE: Chromaticities = [0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 1.0 / 3.0, 1.0 / 3.0];

/// The axes of CIE XYZ themselves: numbers that need no white.
pub const XYZ: Chromaticities = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0];

/// From CIE XYZ to cone responses (Lam 1985, "Bradford").
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

/// Whether two are the same to the digits that files carry.
pub fn same(a: &Chromaticities, b: &Chromaticities) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3)
}

/// From colours of these primaries to Rec. 709. A grey stays grey: white is adapted (Bradford), but for CIE XYZ, which
/// is a measurement and not relative to a white. `None` if they span no colours.
pub fn to_rec_709(from: &Chromaticities) -> Option<Mat3> {
    if !from.iter().all(|number| number.is_finite() && number.abs() <= 10.0) {
        return None;
    }
    let (source, target) = (to_xyz(from)?, to_xyz(&REC_709)?);
    let adapted = if same(from, &XYZ) { DMat3::IDENTITY } else { adaptation(from, &REC_709)? };
    let matrix = target.inverse() * adapted * source;
    matrix.is_finite().then(|| matrix.as_mat3())
}

/// X, Y, Z for Y = 1; `None` where y is 0, which no light has.
fn at(x: f32, y: f32) -> Option<DVec3> {
    let (x, y) = (f64::from(x), f64::from(y));
    (y.abs() > 1e-6).then(|| DVec3::new(x / y, 1.0, (1.0 - x - y) / y))
}

/// Columns: X, Y, Z of red, green and blue, such that (1, 1, 1) is white with Y = 1.
fn to_xyz(&[rx, ry, gx, gy, bx, by, wx, wy]: &Chromaticities) -> Option<DMat3> {
    let primary = |x: f32, y: f32| DVec3::new(x.into(), y.into(), (1.0 - x - y).into());
    let primaries = DMat3::from_cols(primary(rx, ry), primary(gx, gy), primary(bx, by));
    if primaries.determinant().abs() < 1e-6 {
        return None;
    }
    Some(primaries * DMat3::from_diagonal(primaries.inverse() * at(wx, wy)?))
}

/// From the one white to the other.
fn adaptation(from: &Chromaticities, to: &Chromaticities) -> Option<DMat3> {
    let cones = |c: &Chromaticities| Some(BRADFORD * at(c[6], c[7])?);
    Some(BRADFORD.inverse() * DMat3::from_diagonal(cones(to)? / cones(from)?) * BRADFORD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn close(a: Vec3, b: [f32; 3]) {
        assert!(a.distance(b.into()) < 2e-3, "{a} for {b:?}");
    }

    #[test]
    fn known_conversions() {
        let rec_2020 = [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329];
        // ITU-R BT.2087, the inverse of its matrix M2.
        close(to_rec_709(&rec_2020).unwrap() * Vec3::X, [1.6605, -0.1246, -0.0182]);
        // The usual matrix of sRGB (IEC 61966-2-1).
        close(to_rec_709(&XYZ).unwrap() * Vec3::X, [3.2405, -0.9693, 0.0556]);
        close(to_rec_709(&XYZ).unwrap() * Vec3::Z, [-0.4985, 0.0416, 1.0572]);
        close(to_rec_709(&REC_709).unwrap() * Vec3::Y, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn grey_stays_grey_under_another_white() {
        let aces = [0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767];
        close(to_rec_709(&aces).unwrap() * Vec3::ONE, [1.0; 3]);
        close(to_rec_709(&RADIANCE).unwrap() * Vec3::ONE, [1.0; 3]);
    }

    #[test]
    fn primaries_that_span_nothing_are_refused() {
        assert_eq!(to_rec_709(&[0.0; 8]), None);
        assert_eq!(to_rec_709(&[f32::NAN; 8]), None);
        let mut flat = REC_709;
        flat[4..6].copy_from_slice(&REC_709[2..4]);
        assert_eq!(to_rec_709(&flat), None);
        let mut dark = REC_709;
        dark[7] = 0.0;
        assert_eq!(to_rec_709(&dark), None);
    }
}
