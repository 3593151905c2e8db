//! The lens of a camera.

/// A thin lens: what lies in the plane at `focus` is sharp, a point at distance z is spread over a disc of radius
/// `radius * |1 / focus - 1 / z|`, as a tangent of the angle of view (Potmesil and Chakravarty 1981).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Radius of the aperture in scene units, greater than 0.
    pub radius: f32,
    /// Distance of the sharp plane from the camera along the view axis in scene units, greater than 0.
    pub focus: f32,
}

/// Half the height of a full-frame sensor, 24 mm, in metres, glTF's unit of length.
const HALF_SENSOR: f32 = 0.012;

impl Lens {
    /// The lens that a photographer calls f/`number`, focused at `focus`, behind which a full-frame sensor (24 mm high)
    /// sees the vertical field of view `yfov`, in radians. Lengths are in metres.
    pub fn from_f_number(number: f32, focus: f32, yfov: f32) -> Self {
        let image_distance = HALF_SENSOR / (0.5 * yfov).tan();
        // The lens equation, 1 / f = 1 / image + 1 / object.
        let focal_length = image_distance * focus / (image_distance + focus);
        Self { radius: focal_length / (2.0 * number), focus }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f_numbers_are_those_of_a_full_frame_camera() {
        // 50 mm focused far away: half the height of 12 mm at 50 mm; f/2 is then 25 mm wide.
        let yfov = 2.0 * (0.012f32 / 0.05).atan();
        let far = Lens::from_f_number(2.0, 1e6, yfov);
        assert!((far.radius - 0.0125).abs() < 1e-6, "{far:?}");
        // At 0.1 m (twice the focal length of 33.3 mm, the image at 50 mm) 1 / f = 20 + 10.
        let near = Lens::from_f_number(2.0, 0.1, yfov);
        assert!((near.radius - 0.1 / 3.0 / 4.0).abs() < 1e-6, "{near:?}");
    }
}
