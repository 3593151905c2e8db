//! KHR_animation_pointer: which property a pointer names.

use crate::scene::motion::{CameraField, Kind, LampField, NodeField, SurfaceField, Target};

/// The textures of a material by the paths of their members, in the order of
/// [`Material::texture_refs`](crate::scene::Material::texture_refs).
pub(super) const TEXTURES: [&[&str]; 6] = [
    &["pbrMetallicRoughness", "baseColorTexture"],
    &["pbrMetallicRoughness", "metallicRoughnessTexture"],
    &["normalTexture"],
    &["emissiveTexture"],
    &["extensions", "KHR_materials_transmission", "transmissionTexture"],
    &["extensions", "KHR_materials_specular", "specularTexture"],
];

/// The property that a pointer names, by indices of the file, and what values it has; `None` for one that is not known.
/// How many weights a node has is not told.
pub(super) fn target(pointer: &str) -> Option<(Target, Kind)> {
    let path: Vec<&str> = pointer.strip_prefix('/')?.split('/').collect();
    let index = |text: &str| text.bytes().all(|b| b.is_ascii_digit()).then(|| text.parse().ok()).flatten();
    match path.as_slice() {
        ["nodes", node, rest @ ..] => {
            let (field, kind) = node_field(rest)?;
            Some((Target::Node(index(node)?, field), kind))
        }
        ["cameras", camera, rest @ ..] => {
            let field = match rest {
                ["perspective", "yfov"] => CameraField::Yfov,
                ["perspective", "aspectRatio"] => CameraField::AspectRatio,
                ["orthographic", "xmag"] => CameraField::Xmag,
                ["orthographic", "ymag"] => CameraField::Ymag,
                _ => return None,
            };
            Some((Target::Camera(index(camera)?, field), Kind::Numbers(1)))
        }
        ["extensions", "KHR_lights_punctual", "lights", light, rest @ ..] => {
            let (field, width) = match rest {
                ["color"] => (LampField::Color, 3),
                ["intensity"] => (LampField::Intensity, 1),
                ["spot", "innerConeAngle"] => (LampField::InnerAngle, 1),
                ["spot", "outerConeAngle"] => (LampField::OuterAngle, 1),
                _ => return None,
            };
            Some((Target::Lamp(index(light)?, field), Kind::Numbers(width)))
        }
        ["materials", material, rest @ ..] => {
            let (field, width) = surface_field(rest)?;
            Some((Target::Surface(index(material)?, field), Kind::Numbers(width)))
        }
        _ => None,
    }
}

fn node_field(path: &[&str]) -> Option<(NodeField, Kind)> {
    match path {
        ["extensions", "KHR_node_visibility", "visible"] => Some((NodeField::Visible, Kind::Numbers(1))),
        [name] => node_path(name),
        _ => None,
    }
}

/// The property that the path of a channel names.
pub(super) fn node_path(name: &str) -> Option<(NodeField, Kind)> {
    Some(match name {
        "translation" => (NodeField::Translation, Kind::Numbers(3)),
        "rotation" => (NodeField::Rotation, Kind::Rotation),
        "scale" => (NodeField::Scale, Kind::Numbers(3)),
        "weights" => (NodeField::Weights, Kind::Numbers(0)),
        _ => return None,
    })
}

/// A property of a material and how many numbers it has.
fn surface_field(path: &[&str]) -> Option<(SurfaceField, usize)> {
    use SurfaceField as Field;
    Some(match path {
        ["pbrMetallicRoughness", "baseColorFactor"] => (Field::BaseColor, 4),
        ["pbrMetallicRoughness", "metallicFactor"] => (Field::Metallic, 1),
        ["pbrMetallicRoughness", "roughnessFactor"] => (Field::Roughness, 1),
        ["emissiveFactor"] => (Field::Emission, 3),
        ["alphaCutoff"] => (Field::Cutoff, 1),
        ["normalTexture", "scale"] => (Field::NormalScale, 1),
        ["extensions", extension, name] => match (*extension, *name) {
            ("KHR_materials_emissive_strength", "emissiveStrength") => (Field::EmissiveStrength, 1),
            ("KHR_materials_ior", "ior") => (Field::Ior, 1),
            ("KHR_materials_specular", "specularFactor") => (Field::Specular, 1),
            ("KHR_materials_specular", "specularColorFactor") => (Field::SpecularColor, 3),
            ("KHR_materials_transmission", "transmissionFactor") => (Field::Transmission, 1),
            ("KHR_materials_volume", "thicknessFactor") => (Field::Thickness, 1),
            ("KHR_materials_volume", "attenuationColor") => (Field::AttenuationColor, 3),
            ("KHR_materials_volume", "attenuationDistance") => (Field::AttenuationDistance, 1),
            _ => return None,
        },
        [texture @ .., "extensions", "KHR_texture_transform", name] => {
            let place = TEXTURES.iter().position(|known| *known == texture)? as u8;
            match *name {
                "offset" => (Field::TextureOffset(place), 2),
                "rotation" => (Field::TextureRotation(place), 1),
                "scale" => (Field::TextureScale(place), 2),
                _ => return None,
            }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_name_properties() {
        let field = |pointer: &str| target(pointer).map(|(target, _)| target);
        assert_eq!(field("/nodes/12/rotation"), Some(Target::Node(12, NodeField::Rotation)));
        let visible = "/nodes/0/extensions/KHR_node_visibility/visible";
        assert_eq!(field(visible), Some(Target::Node(0, NodeField::Visible)));
        assert_eq!(field("/cameras/1/orthographic/ymag"), Some(Target::Camera(1, CameraField::Ymag)));
        let angle = "/extensions/KHR_lights_punctual/lights/3/spot/outerConeAngle";
        assert_eq!(field(angle), Some(Target::Lamp(3, LampField::OuterAngle)));
        let offset =
            "/materials/2/pbrMetallicRoughness/metallicRoughnessTexture/extensions/KHR_texture_transform/offset";
        assert_eq!(target(offset), Some((Target::Surface(2, SurfaceField::TextureOffset(1)), Kind::Numbers(2))));
        let ior = target("/materials/2/extensions/KHR_materials_ior/ior");
        assert_eq!(ior, Some((Target::Surface(2, SurfaceField::Ior), Kind::Numbers(1))));
        for wrong in [
            "",
            "/",
            "nodes/1/scale",
            "/nodes/-1/scale",
            "/nodes/1",
            "/nodes//scale",
            "/nodes/+1/scale",
            "/nodes/99999999999/scale",
            "/materials/0/name",
            "/meshes/0/weights",
            "/nodes/1/scale/0",
        ] {
            assert_eq!(field(wrong), None, "{wrong}");
        }
    }
}
