//! Punctual lights and cameras at their nodes.

use std::f32::consts::FRAC_PI_2;

use glam::{DMat4, DVec3};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type};
use gltf::json::validation::Checked;
use gltf::json::{Root, camera};

use super::nodes::Placed;
use super::{Notes, Outcome};
use crate::scene::{Camera, Light, Projection};

/// The lights of the placed nodes.
pub(super) fn lights(root: &Root, placed: &[Placed], notes: &mut Notes) -> Outcome<Vec<Light>> {
    let all = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref()).map_or(&[][..], |l| &l.lights);
    let mut lights = Vec::new();
    for Placed { node, to_world } in placed {
        let extension = root.nodes[*node].extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        let Some(index) = extension.map(|e| e.light.value()) else { continue };
        let light = all.get(index).ok_or_else(|| format!("node {node}: light {index} does not exist"))?;
        lights.extend(placed_light(light, index, to_world, notes)?);
    }
    Ok(lights)
}

/// `None` for a light that sends nothing.
fn placed_light(light: &JsonLight, index: usize, to_world: &DMat4, notes: &mut Notes) -> Outcome<Option<Light>> {
    let power = light.color.map(|c| c * light.intensity);
    let intensity = power.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 });
    if intensity != power {
        notes.fault(format!("light {index}: negative or non-finite intensity was set to zero"));
    }
    if light.range.is_some() {
        notes.note("the range of punctual lights is ignored: light falls off with the squared distance".into());
    }
    if intensity == [0.0; 3] {
        return Ok(None);
    }
    let position = to_world.w_axis.truncate().as_vec3().to_array();
    let Some(direction) = unit(to_world, DVec3::NEG_Z) else {
        notes.fault(format!("light {index}: its node has no direction; the light was skipped"));
        return Ok(None);
    };
    let direction = direction.as_vec3().to_array();
    Ok(Some(match &light.type_ {
        Checked::Valid(Type::Directional) => Light::Directional { direction, irradiance: intensity },
        Checked::Valid(Type::Point) => Light::Point { position, intensity },
        Checked::Valid(Type::Spot) => {
            let spot = light.spot.as_ref().ok_or_else(|| format!("light {index}: a spot light without 'spot'"))?;
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2) {
                return Err(format!(
                    "light {index}: spot angles {inner} and {outer} are not 0 <= inner < outer <= pi/2"
                ));
            }
            Light::Spot { position, direction, intensity, inner_angle: inner, outer_angle: outer }
        }
        Checked::Invalid => return Err(format!("light {index}: unknown type")),
    }))
}

/// The cameras of the placed nodes, in the order of the file's camera list.
pub(super) fn cameras(root: &Root, placed: &[Placed], notes: &mut Notes) -> Outcome<Vec<Camera>> {
    let mut cameras = Vec::new();
    for Placed { node, to_world } in placed {
        let Some(index) = root.nodes[*node].camera.map(|c| c.value()) else { continue };
        let json = root.cameras.get(index).ok_or_else(|| format!("node {node}: camera {index} does not exist"))?;
        let projection = projection(json).map_err(|cause| format!("camera {index}: {cause}"))?;
        let forward = unit(to_world, DVec3::NEG_Z);
        let right = forward.and_then(|f| f.cross(unit(to_world, DVec3::Y)?).try_normalize());
        let (Some(forward), Some(right)) = (forward, right) else {
            notes.fault(format!("camera {index}: its node has no direction; the camera was skipped"));
            continue;
        };
        let name = json.name.clone().or_else(|| root.nodes[*node].name.clone()).unwrap_or_default();
        let vec3 = |v: DVec3| v.as_vec3().to_array();
        let camera = Camera {
            name,
            position: vec3(to_world.w_axis.truncate()),
            right: vec3(right),
            up: vec3(right.cross(forward)),
            forward: vec3(forward),
            projection,
        };
        cameras.push((index, camera));
    }
    cameras.sort_by_key(|(index, _)| *index);
    Ok(cameras.into_iter().map(|(_, camera)| camera).collect())
}

fn projection(json: &camera::Camera) -> Outcome<Projection> {
    let positive = |x: f32| x > 0.0 && x.is_finite();
    match (&json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(camera::Type::Perspective), Some(p), _) => {
            if !(p.yfov > 0.0 && p.yfov < std::f32::consts::PI) {
                return Err(format!("a field of view of {} rad", p.yfov));
            }
            Ok(Projection::Perspective { yfov: p.yfov, aspect: p.aspect_ratio.filter(|a| positive(*a)) })
        }
        (Checked::Valid(camera::Type::Orthographic), _, Some(o)) => {
            // A negative half size mirrors the image in some viewers; its magnitude is what is seen.
            let (xmag, ymag) = (o.xmag.abs(), o.ymag.abs());
            if !(positive(xmag) && positive(ymag)) {
                return Err(format!("an image plane of {xmag} by {ymag}"));
            }
            Ok(Projection::Orthographic { xmag, ymag })
        }
        _ => Err("its projection is missing".into()),
    }
}

/// A local direction in world space.
fn unit(to_world: &DMat4, direction: DVec3) -> Option<DVec3> {
    to_world.transform_vector3(direction).try_normalize()
}
