//! Punctual lights and cameras at their nodes.

use std::f32::consts::FRAC_PI_4;

use glam::DMat4;

use super::animation::{Animations, Owner};
use super::document::Document;
use super::nodes::{Life, Placed};
use super::notes::{Notes, Outcome, clip};
use super::part::Part;
use crate::scene::motion::{self, Lamp, Moving, MovingCamera, MovingLamp, Shape, axes, position, usable};
use crate::scene::{Camera, CameraId, Light, LightId, Projection};

/// The lights of the placed nodes. What is wrong with a light is told once for each of its nodes.
pub(super) fn lights(
    (document, animations): (&Document, &Animations),
    placed: &[Placed],
    moving: &mut Moving,
    notes: &mut Notes,
) -> Vec<Light> {
    let mut lights = Vec::new();
    for (place, Placed { to_world, holds, life, .. }) in placed.iter().enumerate() {
        let Some(of) = holds.light else { continue };
        let Life { visible, appears, moves } = *life;
        let changes = animations.change(Owner::Light(of));
        let part = document.lights.part(of as usize);
        let light = part.and_then(|part| placed_light(&part, to_world, changes, notes));
        let Some((lamp, rest)) = notes.or_lost(light).flatten() else { continue };
        if changes || appears || moves {
            let light = LightId::at(lights.len());
            moving.lamps.push(MovingLamp { light, node: place as u32, of, lamp, rest });
        }
        lights.push(if visible { rest } else { motion::dark(rest) });
    }
    lights
}

/// `None` for a light that sends nothing, and never will.
fn placed_light(part: &Part, to_world: &DMat4, changes: bool, notes: &mut Notes) -> Outcome<Option<(Lamp, Light)>> {
    let at = |cause: &str| format!("{}: {cause}", part.place);
    let color = part.numbers("color", notes).unwrap_or([1.0; 3]);
    let brightness = part.number("intensity", notes).unwrap_or(1.0);
    let mut lamp = Lamp { shape: Shape::Point, color, intensity: brightness };
    let intensity = usable(lamp.power());
    if intensity != lamp.power() {
        notes.fault(at("negative or non-finite intensity was set to zero"));
    }
    if part.has("range") {
        notes.note("the range of punctual lights is ignored: light falls off with the squared distance".into());
    }
    if intensity == [0.0; 3] && !changes {
        return Ok(None);
    }
    lamp.shape = match part.text("type", notes).as_deref() {
        Some("directional") => Shape::Directional,
        Some("point") => Shape::Point,
        Some("spot") => {
            let (inner, outer) = spot_angles(part, notes)?;
            Shape::Spot(inner, outer)
        }
        kind => {
            return Err(at(&format!("the type {} is unknown; the light was skipped", clip(kind.unwrap_or("none")))));
        }
    };
    let light = lamp.placed(to_world).map_err(|cause| at(&format!("{cause}; the light was skipped")))?;
    Ok(Some((lamp, light)))
}

/// Inner and outer angle of a spot light.
fn spot_angles(part: &Part, notes: &mut Notes) -> Outcome<(f32, f32)> {
    let spot = part.part("spot", notes);
    if spot.is_none() {
        notes.fault(format!("{}: a spot light without 'spot' has the usual angles", part.place));
    }
    let mut angle = |name| spot.as_ref().and_then(|spot| spot.number(name, notes));
    let (inner, outer) = (angle("innerConeAngle").unwrap_or(0.0), angle("outerConeAngle").unwrap_or(FRAC_PI_4));
    let angles = motion::spot_angles(inner, outer)
        .ok_or_else(|| format!("{}: a spot angle of {outer}; the light was skipped", part.place))?;
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
pub(super) fn cameras(
    (document, animations): (&Document, &Animations),
    placed: &[Placed],
    moving: &mut Moving,
    notes: &mut Notes,
) -> Vec<Camera> {
    let mut cameras = Vec::new();
    for (place, placed) in placed.iter().enumerate() {
        let Some(index) = placed.holds.camera else { continue };
        let part = document.cameras.part(index as usize);
        let camera = part.and_then(|part| camera(document, &part, placed, notes));
        let camera = camera.map_err(|cause| format!("{cause}; the camera was skipped"));
        let changes = placed.life.moves || animations.change(Owner::Camera(index));
        cameras.extend(notes.or_fault(camera).map(|camera| (index, (place as u32, changes), camera)));
    }
    cameras.sort_by_key(|(index, _, _)| *index);
    for (id, (of, (node, _), rest)) in cameras.iter().enumerate().filter(|(_, (_, (_, changes), _))| *changes) {
        let (camera, projection) = (CameraId::at(id), rest.projection);
        moving.cameras.push(MovingCamera { camera, node: *node, of: *of, projection, rest: rest.clone() });
    }
    cameras.into_iter().map(|(_, _, camera)| camera).collect()
}

fn camera(document: &Document, part: &Part, placed: &Placed, notes: &mut Notes) -> Outcome<Camera> {
    let at = |cause: String| format!("{}: {cause}", part.place);
    let projection = projection(part, notes).map_err(at)?;
    let [right, up, forward] = axes(&placed.to_world).ok_or_else(|| at("its node has no direction".into()))?;
    let node = document.nodes.part(placed.node as usize)?;
    let position = position(&placed.to_world).ok_or_else(|| at("its position is not finite".into()))?;
    let name = part.text("name", notes).or_else(|| node.text("name", notes)).unwrap_or_default().into_owned();
    Ok(Camera { name, position, right, up, forward, projection })
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
