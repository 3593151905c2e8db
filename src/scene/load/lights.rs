//! Punctual lights and cameras at their nodes.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DMat4, DVec3};

use super::document::Document;
use super::nodes::Placed;
use super::notes::{Notes, Outcome, clip};
use super::part::Part;
use crate::scene::{Camera, Light, Projection};

/// Largest inner angle of a spot light, as a share of the outer one: the edge has some width.
const SHARPEST_SPOT: f32 = 0.9998;

/// The lights of the placed nodes. What is wrong with a light is told once for each of its nodes.
pub(super) fn lights(document: &Document, placed: &[Placed], notes: &mut Notes) -> Vec<Light> {
    let mut lights = Vec::new();
    for Placed { to_world, holds, .. } in placed {
        let Some(index) = holds.light else { continue };
        let part = document.lights.part(index as usize);
        let light = part.and_then(|part| placed_light(&part, to_world, notes));
        lights.extend(notes.or_lost(light).flatten());
    }
    lights
}

/// `None` for a light that sends nothing.
fn placed_light(part: &Part, to_world: &DMat4, notes: &mut Notes) -> Outcome<Option<Light>> {
    let at = |cause: &str| format!("{}: {cause}", part.place);
    let color = part.numbers("color", notes).unwrap_or([1.0; 3]);
    let brightness = part.number("intensity", notes).unwrap_or(1.0);
    let power = color.map(|c| c * brightness);
    let intensity = power.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 });
    if intensity != power {
        notes.fault(at("negative or non-finite intensity was set to zero"));
    }
    if part.has("range") {
        notes.note("the range of punctual lights is ignored: light falls off with the squared distance".into());
    }
    if intensity == [0.0; 3] {
        return Ok(None);
    }
    let position = position(to_world).ok_or_else(|| at("its position is not finite; the light was skipped"))?;
    let direction = unit(to_world, DVec3::NEG_Z).ok_or_else(|| at("its node has no direction; the light was skipped"));
    let direction = direction.map(|direction| direction.as_vec3().to_array());
    Ok(Some(match part.text("type", notes).as_deref() {
        Some("directional") => Light::Directional { direction: direction?, irradiance: intensity },
        Some("point") => Light::Point { position, intensity },
        Some("spot") => {
            let (inner_angle, outer_angle) = spot_angles(part, notes)?;
            Light::Spot { position, direction: direction?, intensity, inner_angle, outer_angle }
        }
        kind => {
            return Err(at(&format!("the type {} is unknown; the light was skipped", clip(kind.unwrap_or("none")))));
        }
    }))
}

/// Inner and outer angle of a spot light. Angles that are equal, or the wrong way round by rounding, are a sharp edge.
fn spot_angles(part: &Part, notes: &mut Notes) -> Outcome<(f32, f32)> {
    let spot = part.part("spot", notes);
    if spot.is_none() {
        notes.fault(format!("{}: a spot light without 'spot' has the usual angles", part.place));
    }
    let mut angle = |name| spot.as_ref().and_then(|spot| spot.number(name, notes));
    let (inner, outer) = (angle("innerConeAngle").unwrap_or(0.0), angle("outerConeAngle").unwrap_or(FRAC_PI_4));
    if outer.is_nan() || outer <= 0.0 {
        return Err(format!("{}: a spot angle of {outer}; the light was skipped", part.place));
    }
    let widest = outer.min(FRAC_PI_2);
    let sharpest = if (0.0..widest).contains(&inner) { inner } else { inner.clamp(0.0, SHARPEST_SPOT * widest) };
    // NaN is in no range and passes `clamp`.
    let angles = (if sharpest.is_nan() { 0.0 } else { sharpest }, widest);
    if angles != (inner, outer) {
        let (place, used) = (&part.place, angles);
        notes.fault(format!(
            "{place}: spot angles {inner} and {outer} are not 0 <= inner < outer <= pi/2; {} and {} are used",
            used.0, used.1
        ));
    }
    Ok(angles)
}

/// The cameras of the placed nodes, in the order of the file's camera list.
pub(super) fn cameras(document: &Document, placed: &[Placed], notes: &mut Notes) -> Vec<Camera> {
    let mut cameras = Vec::new();
    for placed in placed {
        let Some(index) = placed.holds.camera else { continue };
        let part = document.cameras.part(index as usize);
        let camera = part.and_then(|part| camera(document, &part, placed, notes));
        let camera = camera.map_err(|cause| format!("{cause}; the camera was skipped"));
        cameras.extend(notes.or_fault(camera).map(|camera| (index, camera)));
    }
    cameras.sort_by_key(|(index, _)| *index);
    cameras.into_iter().map(|(_, camera)| camera).collect()
}

fn camera(document: &Document, part: &Part, placed: &Placed, notes: &mut Notes) -> Outcome<Camera> {
    let at = |cause: String| format!("{}: {cause}", part.place);
    let projection = projection(part, notes).map_err(at)?;
    let to_world = &placed.to_world;
    let forward = unit(to_world, DVec3::NEG_Z);
    let right = forward.and_then(|f| f.cross(unit(to_world, DVec3::Y)?).try_normalize());
    let (Some(forward), Some(right)) = (forward, right) else {
        return Err(at("its node has no direction".into()));
    };
    let node = document.nodes.part(placed.node as usize)?;
    let position = position(to_world).ok_or_else(|| at("its position is not finite".into()))?;
    let name = part.text("name", notes).or_else(|| node.text("name", notes)).unwrap_or_default().into_owned();
    let vec3 = |v: DVec3| v.as_vec3().to_array();
    Ok(Camera {
        name,
        position,
        right: vec3(right),
        up: vec3(right.cross(forward)),
        forward: vec3(forward),
        projection,
    })
}

fn projection(part: &Part, notes: &mut Notes) -> Outcome<Projection> {
    let positive = |x: f32| x > 0.0 && x.is_finite();
    let kind = part.text("type", notes);
    // What is there decides where the type is missing or unknown.
    let parallel = match kind.as_deref() {
        Some("perspective") => false,
        Some("orthographic") => true,
        _ => !part.has("perspective"),
    };
    let lens = part.part(if parallel { "orthographic" } else { "perspective" }, notes);
    let lens = lens.ok_or("its projection is missing")?;
    if parallel {
        let mut half = |name| lens.number(name, notes).unwrap_or(f32::NAN);
        // A negative half size mirrors the image in some viewers; its magnitude is what is seen.
        let (xmag, ymag) = (half("xmag").abs(), half("ymag").abs());
        if !(positive(xmag) && positive(ymag)) {
            return Err(format!("an image plane of {xmag} by {ymag}"));
        }
        return Ok(Projection::Orthographic { xmag, ymag });
    }
    let yfov = lens.number("yfov", notes).unwrap_or(f32::NAN);
    if !(yfov > 0.0 && yfov < std::f32::consts::PI) {
        return Err(format!("a field of view of {yfov} rad"));
    }
    Ok(Projection::Perspective { yfov, aspect: lens.number("aspectRatio", notes).filter(|a| positive(*a)) })
}

/// A local direction in world space.
fn unit(to_world: &DMat4, direction: DVec3) -> Option<DVec3> {
    to_world.transform_vector3(direction).try_normalize()
}

/// Where the origin is in the world; `None` beyond single precision.
fn position(to_world: &DMat4) -> Option<[f32; 3]> {
    let position = to_world.w_axis.truncate().as_vec3();
    position.is_finite().then(|| position.to_array())
}
