//! Where an instance stands.

use glam::{DMat4, DVec3};

/// An affine map from the space of a mesh to the world, in double precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform {
    /// Columns of the matrix, as glTF writes them: images of the x, y and z axes, then of the origin. The last row is
    /// 0, 0, 0, 1.
    pub columns: [[f64; 4]; 4],
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// Leaves everything in its place.
    pub const IDENTITY: Self = Self { columns: DMat4::IDENTITY.to_cols_array_2d() };

    /// Moves by `offset`, in scene units.
    pub fn translation(offset: [f64; 3]) -> Self {
        DMat4::from_translation(offset.into()).into()
    }

    /// Scales along the axes by `factors`; a negative one mirrors.
    pub fn scaling(factors: [f64; 3]) -> Self {
        DMat4::from_scale(factors.into()).into()
    }

    /// Turns about `axis` (any length but 0) through the origin by `angle` radians, counter-clockwise as seen from the
    /// tip of the axis. An axis without a direction turns nothing.
    pub fn rotation(axis: [f64; 3], angle: f64) -> Self {
        let axis = DVec3::from(axis).try_normalize();
        axis.map_or(Self::IDENTITY, |axis| DMat4::from_axis_angle(axis, angle).into())
    }

    /// This map, and then `next`.
    pub fn then(self, next: Self) -> Self {
        (next.matrix() * self.matrix()).into()
    }

    /// Whether all entries are finite and the map neither flattens space to a line or a point nor has another last row
    /// than 0, 0, 0, 1. What is flat afterwards is a surface.
    pub fn is_valid(&self) -> bool {
        let matrix = self.matrix();
        matrix.is_finite() && spans_a_plane(&matrix) && matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0]
    }

    pub(super) fn matrix(&self) -> DMat4 {
        DMat4::from_cols_array_2d(&self.columns)
    }
}

impl From<DMat4> for Transform {
    fn from(matrix: DMat4) -> Self {
        Self { columns: matrix.to_cols_array_2d() }
    }
}

/// Whether the image of space is at least a plane, so that a surface stays one. Areas are compared with the squared
/// largest component, so the test does not depend on scale.
pub(super) fn spans_a_plane(m: &DMat4) -> bool {
    /// Height over longest side below which a parallelogram is a line: what is thinner has no area in single precision.
    const THINNEST: f64 = 1e-9;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    let longest = x.abs().max(y.abs()).max(z.abs()).max_element();
    let [x, y, z] = [x, y, z].map(|column| column / longest);
    let widest = x.cross(y).length().max(y.cross(z).length()).max(z.cross(x).length());
    longest > 0.0 && longest.is_finite() && widest > THINNEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_applied_in_the_order_they_are_said() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let map = Transform::scaling([2.0, 3.0, 4.0])
            .then(Transform::rotation([0.0, 0.0, 5.0], quarter))
            .then(Transform::translation([10.0, 0.0, 0.0]));
        let image = |p: [f64; 3]| map.matrix().transform_point3(p.into()).to_array();
        let close = |a: [f64; 3], b: [f64; 3]| assert!(DVec3::from(a).distance(b.into()) < 1e-12, "{a:?} {b:?}");
        close(image([1.0, 0.0, 0.0]), [10.0, 2.0, 0.0]);
        close(image([0.0, 1.0, 0.0]), [7.0, 0.0, 0.0]);
    }

    #[test]
    fn lines_points_and_broken_maps_are_not_valid() {
        assert!(Transform::IDENTITY.is_valid() && Transform::scaling([-1e-9, 1e-9, 1e-9]).is_valid());
        assert!(Transform::scaling([1.0, 0.0, 1e-6]).is_valid(), "a surface");
        assert!(!Transform::scaling([1.0, 0.0, 0.0]).is_valid() && !Transform::scaling([0.0; 3]).is_valid());
        assert!(Transform::scaling([1e200, 0.0, -1e200]).is_valid(), "of any size");
        assert!(!Transform::translation([f64::NAN, 0.0, 0.0]).is_valid());
        let mut projective = Transform::IDENTITY;
        projective.columns[0][3] = 1.0;
        assert!(!projective.is_valid());
        assert_eq!(Transform::rotation([0.0; 3], 1.0), Transform::IDENTITY);
    }
}
