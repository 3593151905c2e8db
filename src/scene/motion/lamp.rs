//! Punctual lights and cameras at their nodes, from the numbers that a file has for them.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{DMat4, DVec3};

use crate::scene::{Camera, CameraId, Light, LightId, Projection};

/// Largest inner angle of a spot light, as a share of the outer one: the edge has some width.
const SHARPEST_SPOT: f32 = 0.9998;

/// A light as the file has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct Lamp {
    pub shape: Shape,
    pub color: [f32; 3],
    pub intensity: f32,
}

/// What kind of light it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) enum Shape {
    Point,
    Directional,
    /// Inner and outer angle in radians.
    Spot(f32, f32),
}

/// A property of a light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum LampField {
    Color,
    Intensity,
    InnerAngle,
    OuterAngle,
}

/// A light that moves or changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct MovingLamp {
    pub light: LightId,
    /// Place of its node.
    pub node: u32,
    /// Index in the file.
    pub of: u32,
    pub lamp: Lamp,
    pub rest: Light,
}

impl Lamp {
    pub fn set(&mut self, field: LampField, value: &[f32]) {
        match (field, value, &mut self.shape) {
            (LampField::Color, [r, g, b], _) => self.color = [*r, *g, *b],
            (LampField::Intensity, [x], _) => self.intensity = *x,
            (LampField::InnerAngle, [x], Shape::Spot(inner, _)) => *inner = *x,
            (LampField::OuterAngle, [x], Shape::Spot(_, outer)) => *outer = *x,
            _ => {}
        }
    }

    /// Intensity times colour, as the file has it.
    pub fn power(&self) -> [f32; 3] {
        self.color.map(|c| c * self.intensity)
    }

    /// The light of a node; fails with what its place lacks.
    pub fn placed(&self, to_world: &DMat4) -> Result<Light, &'static str> {
        let intensity = usable(self.power());
        let position = position(to_world).ok_or("its position is not finite")?;
        let direction = || unit(to_world, DVec3::NEG_Z).ok_or("its node has no direction");
        let direction = || direction().map(|direction| direction.as_vec3().to_array());
        Ok(match self.shape {
            Shape::Directional => Light::Directional { direction: direction()?, irradiance: intensity },
            Shape::Point => Light::Point { position, intensity },
            Shape::Spot(inner, outer) => {
                let (inner_angle, outer_angle) = spot_angles(inner, outer).ok_or("its cone has no angle")?;
                Light::Spot { position, direction: direction()?, intensity, inner_angle, outer_angle }
            }
        })
    }
}

/// Power that is finite and not negative.
pub(in crate::scene) fn usable(power: [f32; 3]) -> [f32; 3] {
    power.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
}

/// Inner and outer angle brought into their ranges; `None` for a cone without an angle. Angles that are equal, or the
/// wrong way round by rounding, are a sharp edge.
pub(in crate::scene) fn spot_angles(inner: f32, outer: f32) -> Option<(f32, f32)> {
    if outer.is_nan() || outer <= 0.0 {
        return None;
    }
    let widest = outer.min(FRAC_PI_2);
    let sharpest = if (0.0..widest).contains(&inner) { inner } else { inner.clamp(0.0, SHARPEST_SPOT * widest) };
    // NaN is in no range and passes `clamp`.
    Some((if sharpest.is_nan() { 0.0 } else { sharpest }, widest))
}

/// A property of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum CameraField {
    Yfov,
    AspectRatio,
    Xmag,
    Ymag,
}

/// A camera that moves or changes.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) struct MovingCamera {
    pub camera: CameraId,
    /// Place of its node.
    pub node: u32,
    /// Index in the file.
    pub of: u32,
    /// In the unit of the file.
    pub projection: Projection,
    pub rest: Camera,
}

/// Changes a number of a projection, if it has it and can have this value.
pub(in crate::scene) fn set_projection(projection: &mut Projection, field: CameraField, value: &[f32]) {
    let &[x] = value else { return };
    let positive = x > 0.0 && x.is_finite();
    match (projection, field) {
        (Projection::Perspective { yfov, .. }, CameraField::Yfov) if positive && x < PI => *yfov = x,
        (Projection::Perspective { aspect, .. }, CameraField::AspectRatio) if positive => *aspect = Some(x),
        // A negative half size mirrors the image in some viewers; its magnitude is what is seen.
        (Projection::Orthographic { xmag, .. }, CameraField::Xmag) if x != 0.0 && x.is_finite() => *xmag = x.abs(),
        (Projection::Orthographic { ymag, .. }, CameraField::Ymag) if x != 0.0 && x.is_finite() => *ymag = x.abs(),
        _ => {}
    }
}

/// The axes of a camera at a node: right, up, forward; `None` where they have no directions.
pub(in crate::scene) fn axes(to_world: &DMat4) -> Option<[[f32; 3]; 3]> {
    let forward = unit(to_world, DVec3::NEG_Z)?;
    let right = forward.cross(unit(to_world, DVec3::Y)?).try_normalize()?;
    Some([right, right.cross(forward), forward].map(|axis| axis.as_vec3().to_array()))
}

/// A local direction in world space.
fn unit(to_world: &DMat4, direction: DVec3) -> Option<DVec3> {
    to_world.transform_vector3(direction).try_normalize()
}

/// Where the origin is in the world; `None` beyond single precision.
pub(in crate::scene) fn position(to_world: &DMat4) -> Option<[f32; 3]> {
    let position = to_world.w_axis.truncate().as_vec3();
    position.is_finite().then(|| position.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_follow_their_numbers_and_their_node() {
        let mut lamp = Lamp { shape: Shape::Spot(0.1, 0.5), color: [1.0, 0.5, 0.0], intensity: 2.0 };
        lamp.set(LampField::Intensity, &[4.0]);
        lamp.set(LampField::OuterAngle, &[9.0]);
        lamp.set(LampField::Color, &[1.0, f32::NAN, -1.0]);
        let place = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0));
        let Ok(Light::Spot { position, direction, intensity, inner_angle, outer_angle }) = lamp.placed(&place) else {
            panic!("{:?}", lamp.placed(&place));
        };
        assert_eq!((position, direction), ([1.0, 2.0, 3.0], [0.0, 0.0, -1.0]));
        assert_eq!((intensity, inner_angle, outer_angle), ([4.0, 0.0, 0.0], 0.1, FRAC_PI_2));
        assert_eq!(lamp.placed(&DMat4::from_scale(DVec3::ZERO)), Err("its node has no direction"));
        assert_eq!(lamp.placed(&DMat4::from_translation(DVec3::splat(1e300))), Err("its position is not finite"));
        lamp.set(LampField::OuterAngle, &[0.0]);
        assert_eq!(lamp.placed(&place), Err("its cone has no angle"));
    }

    #[test]
    fn projections_keep_what_they_can_have() {
        let mut lens = Projection::Perspective { yfov: 0.7, aspect: None };
        for value in [f32::NAN, 0.0, -1.0, 4.0] {
            set_projection(&mut lens, CameraField::Yfov, &[value]);
        }
        set_projection(&mut lens, CameraField::Xmag, &[3.0]);
        assert_eq!(lens, Projection::Perspective { yfov: 0.7, aspect: None });
        set_projection(&mut lens, CameraField::Yfov, &[1.0]);
        set_projection(&mut lens, CameraField::AspectRatio, &[2.0]);
        assert_eq!(lens, Projection::Perspective { yfov: 1.0, aspect: Some(2.0) });
        let mut parallel = Projection::Orthographic { xmag: 1.0, ymag: 1.0 };
        set_projection(&mut parallel, CameraField::Xmag, &[-3.0]);
        set_projection(&mut parallel, CameraField::Ymag, &[0.0]);
        assert_eq!(parallel, Projection::Orthographic { xmag: 3.0, ymag: 1.0 });
    }
}
