//! What a pass consists of, and what a scene saves because it lacks features. Plans are made and looked at; no device
//! takes part.

use crate::error::Result;
use crate::graph::{BufferKind, DeviceClass, Operation, Plan};
use crate::kernels::scene_data::Variant;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::content::Content;
use crate::render::pass::film_state::FilmState;
use crate::render::pass::plan;
use crate::render::scene::memory::Memory;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::Settings;
use crate::scene::Scene;

/// A kernel in a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KernelUse {
    /// File stem of the kernel.
    pub name: &'static str,
    /// Sets of specialisation constants it is compiled for.
    pub variants: Vec<Vec<(u32, u32)>>,
    /// Dispatches of it, windows counted once.
    pub dispatches: usize,
}

/// One pass of a render, as planned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outline {
    /// Dispatches, fills, copies.
    pub passes: usize,
    /// Groups of passes between which a barrier stands.
    pub phases: u32,
    /// Passes per outermost scope, in order.
    pub scopes: Vec<(&'static str, usize)>,
    /// Kernels by name.
    pub kernels: Vec<KernelUse>,
    /// Device bytes that live inside of one pass, shared among buffers, and the inputs of a pass.
    pub transient_bytes: u64,
    /// Bytes of the same buffers if none shared memory with another.
    pub unshared_bytes: u64,
    /// Device bytes of the scene, by kind.
    pub scene_bytes: Vec<(&'static str, u64)>,
    /// Device bytes of the film.
    pub film_bytes: u64,
}

impl Outline {
    /// All device bytes.
    pub fn bytes(&self) -> u64 {
        self.transient_bytes + self.film_bytes + self.scene_bytes.iter().map(|(_, bytes)| bytes).sum::<u64>()
    }

    /// Compiled kernels: every variant counts.
    pub fn pipelines(&self) -> usize {
        self.kernels.iter().map(|kernel| kernel.variants.len()).sum()
    }

    fn of(scene: &Scene, device: &DeviceScene, settings: &Settings) -> Result<Self> {
        let content = Content { scene, device, settings };
        let state = FilmState::new(Memory::Nowhere(device.device_class), content)?;
        let plan = plan::plan(content, &PhotonBudget::of(device, settings), &state).plan;
        let inputs = plan
            .buffers
            .iter()
            .zip(&plan.lifetime)
            .filter(|(info, life)| life.is_some() && matches!(info.kind, BufferKind::Input(_)));
        Ok(Self {
            passes: plan.passes.len(),
            phases: plan.phases(),
            scopes: scopes(&plan),
            kernels: kernels(&plan),
            transient_bytes: plan.arenas.iter().sum::<u64>() + inputs.map(|(info, _)| info.bytes).sum::<u64>(),
            unshared_bytes: plan.transient_bytes(),
            scene_bytes: device.sizes(),
            film_bytes: state.bytes(),
        })
    }
}

fn scopes(plan: &Plan) -> Vec<(&'static str, usize)> {
    let mut counts: Vec<(&'static str, usize)> = Vec::new();
    for pass in &plan.passes {
        let name = pass.scopes.first().map_or("transfers", |&scope| plan.scope_names[scope as usize]);
        match counts.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    counts
}

fn kernels(plan: &Plan) -> Vec<KernelUse> {
    let mut found: std::collections::BTreeMap<&'static str, KernelUse> = std::collections::BTreeMap::new();
    for pass in &plan.passes {
        let (Operation::Dispatch { kernel, constants, .. } | Operation::Windows { kernel, constants, .. }) =
            &pass.operation
        else {
            continue;
        };
        let name = kernel.name;
        let entry = found.entry(name).or_insert(KernelUse { name, variants: vec![], dispatches: 0 });
        entry.dispatches += 1;
        if !entry.variants.contains(constants) {
            entry.variants.push(constants.clone());
        }
    }
    found.into_values().collect()
}

/// What a feature would cost that the scene lacks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saving {
    /// The feature.
    pub name: &'static str,
    /// Passes that are not declared.
    pub passes: usize,
    /// Compiled kernels that do not exist.
    pub pipelines: usize,
    /// Kernels without the code of the feature, and kernels that do not exist without it.
    pub kernels: Vec<&'static str>,
    /// Device bytes that are not allocated; few, because the buffers of a pass share memory. The feature's own data,
    /// such as texels, is not among them.
    pub bytes: u64,
}

/// The pass that a scene needs beside the pass with everything.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Savings {
    /// With what the scene needs.
    pub lean: Outline,
    /// With every feature.
    pub full: Outline,
    /// Each feature that is left out, by itself.
    pub left_out: Vec<Saving>,
    /// Triangles that no ray can hit, left out of the tree.
    pub skipped_triangles: u32,
}

/// A feature: whether the scene has it, and how to give it to a scene without.
struct Feature {
    name: &'static str,
    has: fn(&DeviceScene) -> bool,
    add: fn(&mut DeviceScene),
}

/// Every feature that passes, kernels or buffers depend on.
const FEATURES: [Feature; 13] = [
    Feature { name: "caustic photons", has: |d| d.caster_count > 0, add: |d| d.caster_count = 1 },
    Feature {
        name: "mirrors and glossy surfaces",
        has: |d| d.variant.glossy,
        add: |d| (d.variant.glossy, d.variant.gathers_glossy) = (true, true),
    },
    Feature { name: "glass", has: |d| d.variant.glass, add: |d| (d.variant.glass, d.variant.glossy) = (true, true) },
    Feature { name: "absorption", has: |d| d.variant.absorption, add: |d| d.variant.absorption = true },
    Feature {
        name: "textures",
        has: |d| d.variant.textures,
        add: |d| {
            d.variant.textures = true;
            d.variant.uv0_at = d.variant.uv0_at.max(grown(&mut d.variant, 1));
        },
    },
    Feature {
        name: "normal maps",
        has: |d| d.variant.normal_maps,
        add: |d| {
            (d.variant.normal_maps, d.variant.smooth_normals, d.variant.gathers_smooth) = (true, true, true);
            d.variant.tangent_at = d.variant.tangent_at.max(grown(&mut d.variant, 3));
        },
    },
    Feature { name: "alpha masks", has: |d| d.variant.alpha_mask, add: |d| d.variant.alpha_mask = true },
    Feature {
        name: "smooth normals",
        has: |d| d.variant.smooth_normals,
        add: |d| (d.variant.smooth_normals, d.variant.gathers_smooth) = (true, true),
    },
    Feature { name: "environment light", has: |d| d.variant.environment, add: |d| d.variant.environment = true },
    Feature { name: "emissive triangles", has: |d| d.variant.area_lights, add: |d| d.variant.area_lights = true },
    Feature {
        name: "point, spot and directional lights",
        has: |d| d.variant.delta_lights,
        add: |d| d.variant.delta_lights = true,
    },
    Feature { name: "guided photons", has: |d| d.variant.guided, add: |d| d.variant.guided = true },
    Feature {
        name: "guided light samples",
        has: |d| d.variant.guided_samples,
        add: |d| d.variant.guided_samples = true,
    },
];

/// Makes room for `vectors` more per triangle and returns where they begin.
fn grown(variant: &mut Variant, vectors: u32) -> u32 {
    variant.shading_stride += vectors;
    variant.shading_stride - vectors
}

/// Plans a pass of `scene` with what it needs, with everything, and with each feature that it lacks, for a device of
/// this class.
///
/// # Errors
/// Those of [`Settings::validate_plan`].
pub fn savings(scene: &Scene, settings: &Settings, class: DeviceClass) -> Result<Savings> {
    settings.validate_plan(scene, class)?;
    let lean = Settings { full_program: false, ..settings.clone() };
    let mut device = DeviceScene::in_memory(Memory::Nowhere(class), scene, &lean)?;
    device.take_maps(Memory::Nowhere(class), settings, false)?;
    let lean = Outline::of(scene, &device, settings)?;
    let lacking = || FEATURES.iter().filter(|feature| !(feature.has)(&device));
    let with = |features: &mut dyn Iterator<Item = &Feature>| {
        let mut other = device.clone();
        features.for_each(|feature| (feature.add)(&mut other));
        Outline::of(scene, &other.with_variant(other.variant), settings)
    };
    let full = with(&mut lacking())?;
    let left_out = lacking()
        .map(|feature| Ok(saving(feature.name, &lean, &with(&mut std::iter::once(feature))?)))
        .collect::<Result<_>>()?;
    Ok(Savings { lean, full, left_out, skipped_triangles: device.skipped_triangles })
}

fn saving(name: &'static str, lean: &Outline, with: &Outline) -> Saving {
    let known = |kernel: &KernelUse| lean.kernels.iter().find(|k| k.name == kernel.name);
    let differs = |kernel: &&KernelUse| known(kernel).is_none_or(|k| k.variants != kernel.variants);
    Saving {
        name,
        passes: with.passes.saturating_sub(lean.passes),
        pipelines: with.pipelines().saturating_sub(lean.pipelines()),
        kernels: with.kernels.iter().filter(differs).map(|kernel| kernel.name).collect(),
        bytes: with.bytes().saturating_sub(lean.bytes()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::settings::Method;
    use crate::scene::shapes::Mesh;
    use crate::scene::{Camera, Light, Material};

    fn of(material: Material) -> Savings {
        let quad = Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
        let light = Light::Point { position: [0.0, 1.0, 0.0], intensity: [1.0; 3] };
        let camera = Camera::look_at([0.0, 2.0, 2.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7);
        let scene = Scene::from_parts(vec![(quad, material)], vec![light], camera);
        let settings = Settings { width: 32, height: 24, photons: Some(1000), ..Settings::of(Method::Photons) };
        savings(&scene, &settings, DeviceClass::Cpu).expect("a plan needs no device")
    }

    fn names(savings: &Savings) -> Vec<&str> {
        savings.left_out.iter().map(|saving| saving.name).collect()
    }

    #[test]
    fn a_diffuse_scene_leaves_out_passes_kernels_and_bytes() {
        let diffuse = of(Material::lambert([0.5; 3]));
        assert_eq!(diffuse.left_out.len(), 12, "everything but the point light: {:?}", names(&diffuse));
        let of = |name: &str| diffuse.left_out.iter().find(|s| s.name == name).expect("left out");
        let caustic = of("caustic photons");
        assert_eq!((caustic.pipelines, caustic.kernels.as_slice()), (2, ["photon_bounce", "photon_emit"].as_slice()));
        // Emission and 24 bounces of it. Their memory is that of the global photons, which come after.
        assert!(caustic.passes > 24, "{caustic:?}");
        assert!(of("mirrors and glossy surfaces").passes > 24, "eye paths go on");
        assert!(of("textures").kernels.contains(&"eye_shade"));
        assert_eq!(of("textures").bytes, 2 * 16, "texture coordinates of two triangles");
        assert!(diffuse.full.passes >= diffuse.lean.passes + caustic.passes);
        assert!(diffuse.full.bytes() > diffuse.lean.bytes());
        assert!(diffuse.full.unshared_bytes > diffuse.lean.unshared_bytes + 24 * 500 * 64, "bounces of 500 photons");
        assert!(diffuse.lean.scopes.iter().all(|(name, _)| *name != "caustic photons"));
        assert!(diffuse.full.scopes.iter().any(|(name, passes)| *name == "caustic photons" && *passes > 24));
    }

    #[test]
    fn what_a_scene_needs_is_not_left_out() {
        let mirror = of(Material::mirror());
        let left_out = names(&mirror);
        assert!(!left_out.contains(&"caustic photons") && !left_out.contains(&"mirrors and glossy surfaces"));
        assert!(left_out.contains(&"glass") && left_out.contains(&"textures"));
        assert!(mirror.lean.passes > of(Material::lambert([0.5; 3])).lean.passes);
    }
}
