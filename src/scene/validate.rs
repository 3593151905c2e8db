//! What a renderer relies on, checked for scenes built by hand. Loaded scenes pass.

use super::{Alpha, Camera, Image, Instance, Light, Material, Mesh, Projection, Scene, Texture, Transform};
use crate::error::{Error, Result};

/// Triangles of all instances together that a renderer's tree can address.
const MOST_TRIANGLES: u64 = (1 << 27) - 1;

/// What is wrong; the scene is named by the caller.
pub(crate) type Check = std::result::Result<(), String>;

impl Scene {
    /// Whether everything in the scene can be rendered: indices name what exists, lists of attributes fit, numbers are
    /// finite and in their ranges.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first fault.
    pub fn validate(&self) -> Result<()> {
        let check = || {
            self.references()?;
            each("mesh", &self.meshes, mesh_numbers)?;
            each("instance", &self.instances, instance_numbers)?;
            each("material", &self.materials, material_numbers)?;
            each("light", &self.lights, light_numbers)?;
            each("camera", &self.cameras, camera_numbers)
        };
        self.named(check())
    }

    /// Whether every index names what exists and every list has its length: the part of [`Scene::validate`] without
    /// which a scene has no meaning. Triangles with a corner that is not finite do no harm: renderers leave them out.
    ///
    /// # Errors
    /// [`Error::Scene`] with the first fault.
    pub fn validate_references(&self) -> Result<()> {
        self.named(self.references())
    }

    /// A check of this scene with its name in the error.
    pub(crate) fn named(&self, check: Check) -> Result<()> {
        let name = if self.path.as_os_str().is_empty() { "a scene in memory".as_ref() } else { self.path.as_path() };
        check.map_err(|fault| Error::scene(name, fault))
    }

    fn references(&self) -> Check {
        each("mesh", &self.meshes, |mesh| mesh_references(mesh, self.materials.len()))?;
        each("instance", &self.instances, |instance| inside("mesh", instance.mesh.index(), self.meshes.len()))?;
        each("material", &self.materials, |material| material_references(material, self.textures.len()))?;
        each("texture", &self.textures, |&Texture { image, .. }| inside("image", image as usize, self.images.len()))?;
        each("image", &self.images, |Image { width, height, rgba }| texels(*width, *height, rgba.len()))?;
        if let Some(map) = &self.environment {
            texels(map.width, map.height, map.radiance.len()).map_err(|fault| format!("environment: {fault}"))?;
        }
        let count = |i: &Instance| self.meshes[i.mesh.index()].triangles.len() as u64;
        let triangles = self.instances.iter().map(count).fold(0, u64::saturating_add);
        if triangles > MOST_TRIANGLES {
            return Err(format!("{triangles} triangles, more than {MOST_TRIANGLES}"));
        }
        Ok(())
    }
}

impl Camera {
    /// What is wrong with its numbers, if anything is.
    pub(crate) fn check(&self) -> Check {
        camera_numbers(self)
    }
}

impl Light {
    /// What is wrong with its numbers, if anything is.
    pub(crate) fn check(&self) -> Check {
        light_numbers(self)
    }
}

impl Transform {
    /// What is wrong with it, if anything is.
    pub(crate) fn check(&self) -> Check {
        match self.is_valid() {
            true => Ok(()),
            false => Err("its transform is not finite, is flat in two directions, or is not affine".into()),
        }
    }
}

impl Material {
    /// What is wrong with it in a scene of so many textures, if anything is.
    pub(crate) fn check(&self, textures: usize) -> Check {
        material_references(self, textures)?;
        material_numbers(self)
    }
}

impl Mesh {
    /// What is wrong with other positions and normals for it, if anything is.
    pub(crate) fn check_vertices(&self, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Check {
        let count = self.positions.len();
        if positions.len() != count || (!normals.is_empty() && normals.len() != count) {
            return Err(format!("{} positions and {} normals for {count} vertices", positions.len(), normals.len()));
        }
        finite("position", positions)?;
        finite("normal", normals)
    }

    /// What is wrong with other tangents for it, if anything is.
    pub(crate) fn check_tangents(&self, tangents: &[[f32; 4]]) -> Check {
        if tangents.len() != self.positions.len() {
            return Err(format!("{} tangents for {} vertices", tangents.len(), self.positions.len()));
        }
        finite("tangent", tangents)
    }
}

/// Checks a list, and names the part at fault.
fn each<T>(kind: &str, list: &[T], check: impl Fn(&T) -> Check) -> Check {
    let named = |(index, part)| check(part).map_err(|fault| format!("{kind} {index}: {fault}"));
    list.iter().enumerate().try_for_each(named)
}

fn inside(kind: &str, index: usize, count: usize) -> Check {
    if index < count { Ok(()) } else { Err(format!("it names {kind} {index}, there are {count}")) }
}

fn texels(width: u32, height: u32, count: usize) -> Check {
    let wanted = u64::from(width) * u64::from(height);
    match wanted == count as u64 && count > 0 {
        true => Ok(()),
        false => Err(format!("{count} texels for {width} x {height}")),
    }
}

fn mesh_references(mesh: &Mesh, materials: usize) -> Check {
    let count = mesh.positions.len();
    inside("material", mesh.material.index(), materials)?;
    let lengths = [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("texture coordinates 0", mesh.uvs[0].len()),
        ("texture coordinates 1", mesh.uvs[1].len()),
        ("colours", mesh.colors.len()),
    ];
    if let Some((name, length)) = lengths.into_iter().find(|(_, length)| *length != 0 && *length != count) {
        return Err(format!("{length} {name} for {count} vertices"));
    }
    let outside = |t: &[u32; 3]| t.iter().any(|&i| i as usize >= count);
    match mesh.triangles.iter().position(outside) {
        Some(t) => Err(format!("triangle {t} names vertices {:?}, there are {count}", mesh.triangles[t])),
        None => Ok(()),
    }
}

fn material_references(material: &Material, textures: usize) -> Check {
    for reference in material.texture_refs() {
        inside("texture", reference.texture as usize, textures)?;
        inside("texture coordinate set", reference.uv_set as usize, 2)?;
    }
    Ok(())
}

fn finite<'a, const N: usize>(what: &str, values: impl IntoIterator<Item = &'a [f32; N]>) -> Check {
    match values.into_iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        Some(index) => Err(format!("{what} {index} is not finite")),
        None => Ok(()),
    }
}

fn mesh_numbers(mesh: &Mesh) -> Check {
    finite("position", &mesh.positions)?;
    finite("normal", &mesh.normals)?;
    finite("tangent", &mesh.tangents)?;
    finite("texture coordinate 0", &mesh.uvs[0])?;
    finite("texture coordinate 1", &mesh.uvs[1])?;
    finite("colour", &mesh.colors)
}

fn instance_numbers(instance: &Instance) -> Check {
    instance.transform.as_ref().map_or(Ok(()), Transform::check)
}

/// A number within bounds, which NaN never is.
fn range(what: &str, value: f32, [low, high]: [f32; 2]) -> Check {
    if value >= low && value <= high { Ok(()) } else { Err(format!("{what} {value} is not within {low} and {high}")) }
}

fn material_numbers(m: &Material) -> Check {
    let unit = [0.0, 1.0];
    m.base_color.iter().try_for_each(|&x| range("base colour", x, unit))?;
    range("metallic", m.metallic, unit)?;
    range("roughness", m.roughness, unit)?;
    range("specular", m.specular, unit)?;
    range("transmission", m.transmission, unit)?;
    range("index of refraction", m.ior, [1.0, f32::MAX])?;
    let positive = [("emission", m.emissive), ("specular colour", m.specular_color), ("absorption", m.absorption)];
    for (what, values) in positive {
        values.iter().try_for_each(|&x| range(what, x, [0.0, f32::MAX]))?;
    }
    range("normal scale", m.normal_scale, [f32::MIN, f32::MAX])?;
    if let Alpha::Mask(cutoff) = m.alpha {
        range("alpha cut-off", cutoff, [f32::MIN, f32::MAX])?;
    }
    m.texture_refs().try_for_each(|r| finite("row of a texture transform", &r.transform))
}

fn unit_vector(what: &str, v: &[f32; 3]) -> Check {
    let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
    range(&format!("the length of its {what}"), length, [0.999, 1.001])
}

fn light_numbers(light: &Light) -> Check {
    let strength = |what: &str, v: &[f32; 3]| v.iter().try_for_each(|&x| range(what, x, [0.0, f32::MAX]));
    match light {
        Light::Point { position, intensity } => {
            finite("position", [position])?;
            strength("intensity", intensity)
        }
        Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
            finite("position", [position])?;
            unit_vector("direction", direction)?;
            strength("intensity", intensity)?;
            range("outer angle", *outer_angle, [0.0, std::f32::consts::FRAC_PI_2])?;
            range("inner angle", *inner_angle, [0.0, *outer_angle])
        }
        Light::Directional { direction, irradiance } => {
            unit_vector("direction", direction)?;
            strength("irradiance", irradiance)
        }
    }
}

fn camera_numbers(camera: &Camera) -> Check {
    finite("position", [&camera.position])?;
    for (what, axis) in [("right", &camera.right), ("up", &camera.up), ("forward", &camera.forward)] {
        unit_vector(what, axis)?;
    }
    match camera.projection {
        Projection::Perspective { yfov, .. } => range("field of view", yfov, [f32::MIN_POSITIVE, std::f32::consts::PI]),
        Projection::Orthographic { xmag, ymag } => {
            range("half width", xmag, [f32::MIN_POSITIVE, f32::MAX])?;
            range("half height", ymag, [f32::MIN_POSITIVE, f32::MAX])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MaterialId, MeshId, TextureRef};

    fn scene() -> Scene {
        let square = Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let camera = Camera::look_at([0.0, 0.0, 5.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7);
        let lamp = Light::Point { position: [0.0; 3], intensity: [1.0; 3] };
        Scene::from_parts(vec![(square, Material::lambert([0.5; 3]))], vec![lamp], camera)
    }

    #[test]
    fn the_first_fault_is_named() {
        scene().validate().expect("a scene without a fault");
        let missing = TextureRef { texture: 2, uv_set: 0, transform: [[0.0; 3]; 2] };
        let fault = |damage: &dyn Fn(&mut Scene)| {
            let mut scene = scene();
            damage(&mut scene);
            let references = scene.validate_references().is_err();
            (scene.validate().expect_err("a fault").to_string(), references)
        };
        type Damage<'a> = &'a dyn Fn(&mut Scene);
        let cases: [(Damage<'_>, &str, bool); 9] = [
            (&|s| s.meshes[0].triangles[1][2] = 4, "mesh 0: triangle 1 names vertices [0, 3, 4], there are 4", true),
            (&|s| s.meshes[0].normals.truncate(3), "mesh 0: 3 normals for 4 vertices", true),
            (&|s| s.meshes[0].material = MaterialId(1), "mesh 0: it names material 1, there are 1", true),
            (&|s| s.instances[0].mesh = MeshId(7), "instance 0: it names mesh 7, there are 1", true),
            (&|s| s.materials[0].normal_texture = Some(missing), "it names texture 2, there are 0", true),
            (&|s| s.meshes[0].positions[2][1] = f32::NAN, "mesh 0: position 2 is not finite", false),
            (&|s| s.materials[0].roughness = 1.5, "material 0: roughness 1.5 is not within 0 and 1", false),
            (&|s| s.instances[0].transform = Some(Transform::scaling([0.0; 3])), "is flat in two", false),
            (&|s| s.cameras[0].up = [0.0, 2.0, 0.0], "camera 0: the length of its up 2 is not", false),
        ];
        for (damage, text, is_reference) in cases {
            let (found, references) = fault(damage);
            assert!(found.contains(text) && found.starts_with("a scene in memory"), "{found}");
            assert_eq!(references, is_reference, "{found}");
        }
    }
}
