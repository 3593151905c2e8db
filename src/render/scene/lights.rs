//! The light table: every emitter with the probability of being chosen.
//!
//! Most of it is proportional to power. A part is shared alike by all lights, where the triangles of one emission are
//! one light, so that a weak light is found where no strong one shines: without it a lamp of 1e-8 of the power would be
//! chosen once in 1e8 samples.
//!
//! Triangles that shine follow the punctual lights in the order of the tree's leaves, which choices of lights depend
//! on, or in the order of the scene ([`Host::lights_by_id`]).

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::host::Host;
use super::sky::Sky;
use crate::constants::{GUIDE_PARALLEL, LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE};
use crate::kernels::generated::Light as DeviceLight;
use crate::scene::{Light, Material, Scene};

/// Lights and the sampling tables of the environment.
#[derive(Default)]
pub struct LightTable {
    pub lights: Vec<DeviceLight>,
    /// Per material: density per area with which a light sample is a point of it; 0 where it is no light.
    pub densities: Vec<f32>,
    pub has_triangles: bool,
    pub has_delta: bool,
    /// Sum of the powers, luminance [W].
    pub power: f64,
    /// By the emission of triangles: how much more often they are chosen than by power.
    preferences: BTreeMap<[u32; 3], f64>,
}

/// Part of the samples that lights share alike.
const EVEN: f64 = 0.1;

fn bits(emission: [f32; 3]) -> [u32; 3] {
    emission.map(f32::to_bits)
}

pub(super) fn luminance(c: [f32; 3]) -> f64 {
    0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2])
}

impl LightTable {
    /// Lights of `scene`, of which `host` knows the rest.
    pub fn of(scene: &Scene, host: &Host) -> Self {
        let radius = f64::from(host.tree.radius);
        let mut table = Self::default();
        let mut powers = Vec::new();
        for light in &scene.lights {
            let (mut device, power) = punctual(light, radius);
            if device.kind == LIGHT_DIRECTIONAL {
                let parallel = table.lights.iter().filter(|light| light.kind == LIGHT_DIRECTIONAL).count() as u32;
                device.guide = if parallel < GUIDE_PARALLEL { parallel + 1 } else { 0 };
            }
            table.push(&mut powers, device, power);
        }
        table.has_delta = !table.lights.is_empty();
        table.add_triangles(&mut powers, scene, host);
        if let Some(sky) = &host.sky {
            let guide = GUIDE_PARALLEL + 1;
            let light = DeviceLight { kind: LIGHT_ENVIRONMENT, guide, ..DeviceLight::default() };
            table.push(&mut powers, light, sky.power(radius));
        }
        table.finish(&powers);
        let density = |(m, e): (&Material, &[f32; 3])| {
            let shines = table.has_triangles && !m.unlit && luminance(*e) > 0.0;
            let preferred = table.preferences.get(&bits(*e)).copied().unwrap_or(1.0);
            if shines { (preferred * (sides(m) * PI * luminance(*e) / table.power)) as f32 } else { 0.0 }
        };
        table.densities = scene.materials.iter().zip(&host.emission).map(density).collect();
        table
    }

    fn add_triangles(&mut self, powers: &mut Vec<f64>, scene: &Scene, host: &Host) {
        let material_of = |id: u32| host.world.material[id as usize] as usize;
        let shines = |&(_, id): &(usize, u32)| {
            let material = material_of(id);
            luminance(host.emission[material]) > 0.0 && !scene.materials[material].unlit
        };
        let mut places: Vec<_> = host.tree.bvh.order.iter().copied().enumerate().filter(shines).collect();
        if host.lights_by_id {
            places.sort_unstable_by_key(|(_, id)| *id);
        }
        for (at, id) in places {
            let (material, area) = (material_of(id), host.world.area(id));
            let emission = host.emission[material];
            let device = DeviceLight {
                kind: LIGHT_TRIANGLE,
                emission,
                area: area as f32,
                triangle: at as u32,
                ..DeviceLight::default()
            };
            let sides = sides(&scene.materials[material]);
            self.push(powers, device, sides * PI * area * luminance(emission));
            self.has_triangles = true;
        }
    }

    fn push(&mut self, powers: &mut Vec<f64>, light: DeviceLight, power: f64) {
        if power > 0.0 && power.is_finite() {
            self.lights.push(light);
            powers.push(power);
        }
    }

    fn finish(&mut self, powers: &[f64]) {
        self.power = powers.iter().sum();
        let mut emissions = BTreeMap::new();
        let triangles = self.lights.iter().zip(powers).filter(|(light, _)| light.kind == LIGHT_TRIANGLE);
        triangles.clone().for_each(|(light, power)| *emissions.entry(bits(light.emission)).or_insert(0.0) += power);
        let groups = (self.lights.len() - triangles.count() + emissions.len()) as f64;
        let preference = |power: f64| (1.0 - EVEN) + EVEN * (self.power / power) / groups;
        self.preferences = emissions.into_iter().map(|(emission, power)| (emission, preference(power))).collect();
        let mut cumulative = 0.0;
        for (light, power) in self.lights.iter_mut().zip(powers) {
            let triangle = light.kind == LIGHT_TRIANGLE;
            let preferred = if triangle { self.preferences[&bits(light.emission)] } else { preference(*power) };
            let probability = preferred * (power / self.power);
            cumulative += probability;
            light.probability = probability as f32;
            light.cumulative = cumulative as f32;
        }
    }

    /// A bound of the power that the photons of a pass carry together, for each of red, green and blue [W]: the power
    /// of all lights as luminance, times the largest ratio of this channel to luminance among the lights.
    pub fn greatest_power(&self, sky: Option<&Sky>) -> [f64; 3] {
        let sky = sky.map_or([0.0; 3], |sky| sky.sum);
        let colours =
            self.lights.iter().map(|light| if light.kind == LIGHT_ENVIRONMENT { sky } else { light.emission });
        let shares = colours.map(|c| (c, luminance(c))).filter(|(_, y)| *y > 0.0 && y.is_finite());
        shares
            .fold([0.0; 3], |most, (c, y)| std::array::from_fn(|k| f64::max(most[k], f64::from(c[k]) / y * self.power)))
    }

    /// Exponents of the powers of two in which the film counts radiance and depth: typical values of a scene of this
    /// radius are near them. They follow a scene that is scaled by a power of two, so that its picture has the same
    /// bits.
    pub fn film_exponents(&self, scene: &Scene, host: &Host) -> [i32; 2] {
        /// What is seen of a light itself may be brighter than what it lights up by this factor before it decides.
        const PEAK: f64 = 65536.0;
        let unlit = scene.materials.iter().filter(|m| m.unlit).map(|m| luminance([0, 1, 2].map(|k| m.base_color[k])));
        let emissive = scene.materials.iter().map(|m| luminance(m.emissive));
        let radius = f64::from(host.tree.radius);
        let peak = unlit.chain(emissive).chain([host.sky_peak]).filter(|x| x.is_finite()).fold(0.0, f64::max);
        // The radiance of a white surface that all light falls on evenly.
        let typical = self.power / (4.0 * PI * PI * radius * radius);
        let exponent = |x: f64| if x > 0.0 && x.is_finite() { (x.log2().ceil() as i32).clamp(-100, 100) } else { 0 };
        [exponent(typical.max(peak / PEAK)), exponent(radius)]
    }

    /// Probability with which the environment is chosen as a light.
    pub fn environment_probability(&self) -> f32 {
        self.lights.iter().find(|light| light.kind == LIGHT_ENVIRONMENT).map_or(0.0, |light| light.probability)
    }
}

/// Sides of a surface that emit.
fn sides(m: &Material) -> f64 {
    if m.double_sided { 2.0 } else { 1.0 }
}

fn punctual(light: &Light, radius: f64) -> (DeviceLight, f64) {
    match *light {
        Light::Point { position, intensity } => (
            DeviceLight { kind: LIGHT_POINT, position, emission: intensity, ..DeviceLight::default() },
            4.0 * PI * luminance(intensity),
        ),
        Light::Spot { position, direction, intensity, inner_angle, outer_angle } => {
            let (inner, outer) = (f64::from(inner_angle).cos(), f64::from(outer_angle).cos());
            // The falloff t^2 between the cones integrates to a third of the width.
            let solid = 2.0 * PI * ((1.0 - inner) + (inner - outer) / 3.0);
            let device = DeviceLight {
                kind: LIGHT_SPOT,
                position,
                direction,
                emission: intensity,
                cos_inner: inner as f32,
                cos_outer: outer as f32,
                ..DeviceLight::default()
            };
            (device, solid * luminance(intensity))
        }
        Light::Directional { direction, irradiance } => (
            DeviceLight { kind: LIGHT_DIRECTIONAL, direction, emission: irradiance, ..DeviceLight::default() },
            PI * radius * radius * luminance(irradiance),
        ),
    }
}

/// Emission of each material averaged over its texture.
pub fn average_emission(scene: &Scene) -> Vec<[f32; 3]> {
    let linear = |byte: u8| {
        let c = f64::from(byte) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let mean = |image: &crate::scene::Image, channel: usize| {
        let sum: f64 = image.rgba.iter().map(|texel| linear(texel[channel])).sum();
        // An all-black texture emits nothing; any other keeps a chance everywhere.
        sum / image.rgba.len().max(1) as f64
    };
    let emission = |m: &crate::scene::Material| match m.emissive_texture {
        Some(texture) => {
            let image = &scene.images[scene.textures[texture.texture as usize].image as usize];
            std::array::from_fn(|k| m.emissive[k] * mean(image, k) as f32)
        }
        None => m.emissive,
    };
    scene.materials.iter().map(emission).collect()
}
