//! The environment maps of a scene: where they are taken, and what they show.

use std::sync::Arc;

use super::memory::Memory;
use super::upload::DeviceScene;
use crate::constants::MAP_CANDIDATES;
use crate::error::Result;
use crate::graph::{Graph, Persistent, Runtime};
use crate::kernels::generated::{BvhTriangle, MapTexel};
use crate::kernels::maps::{self, Choice, Maps, Seen, Shape};
use crate::kernels::trace::scene_bounds;
use crate::render::settings::{MapSettings, Settings, Tracer};

/// The maps of a scene on the device.
#[derive(Debug, Clone)]
pub struct SceneMaps {
    /// How they were asked for.
    pub settings: MapSettings,
    /// Where they are taken.
    pub centres: Persistent<[f32; 4]>,
    /// What they show.
    pub texels: Persistent<MapTexel>,
    /// How their centres were chosen.
    pub about: Arc<About>,
}

/// How centres were chosen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Centres [scene units].
    pub centres: Vec<[f32; 3]>,
    /// Which candidates they are.
    pub choice: Option<Choice>,
    /// Part of the area that any candidate sees that the centres see, as the candidates' maps show it.
    pub covered: f64,
    /// Seconds that the choice took, and the maps.
    pub seconds: [f64; 2],
}

/// Random places in a box: the same for the same box.
pub fn candidates([low, high]: [[f32; 3]; 2], count: u32) -> Vec<[f32; 3]> {
    let number = |index: u32, axis: u32| {
        // Mixing of bits after Wellons' "lowbias32", as lib/hash.glsl has it.
        let mut x = (index * 3 + axis).wrapping_mul(0x9e37_79b9) ^ 0x6d61_7073;
        x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
        x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
        f64::from(x ^ (x >> 16)) / 4_294_967_296.0
    };
    let at = |index, axis: usize| {
        let (low, high) = (f64::from(low[axis]), f64::from(high[axis]));
        (low + number(index, axis as u32) * (high - low)) as f32
    };
    (0..count.min(MAP_CANDIDATES)).map(|index| std::array::from_fn(|axis| at(index, axis))).collect()
}

impl DeviceScene {
    /// Takes the maps that the settings want photons to be traced in, if there are none or they are stale.
    ///
    /// # Errors
    /// Those of the device.
    pub(in crate::render) fn take_maps(&mut self, memory: Memory<'_>, settings: &Settings, stale: bool) -> Result<()> {
        let Tracer::Maps(wanted) = settings.tracer else {
            self.maps = None;
            return Ok(());
        };
        if !stale && self.maps.as_ref().is_some_and(|maps| maps.settings == wanted) {
            return Ok(());
        }
        let bounds = scene_bounds(&self.host.tree.bvh.nodes);
        let (triangles, count, radius) = (&self.triangles, self.triangle_count, self.radius);
        let surfaces = Surfaces { triangles, count, radius, bounds: [bounds.min, bounds.max] };
        self.maps = Some(SceneMaps::new(memory, surfaces, wanted)?);
        self.generation += 1;
        Ok(())
    }
}

/// What the maps are drawn from.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// Triangles on the device, in leaf order.
    pub triangles: &'a Persistent<BvhTriangle>,
    /// How many of them there are; the buffer may be longer.
    pub count: u32,
    /// Radius of the scene's sphere.
    pub radius: f32,
    /// The box that candidates lie in.
    pub bounds: [[f32; 3]; 2],
}

impl SceneMaps {
    /// Chooses the centres and draws the maps, on a device.
    ///
    /// # Errors
    /// Those of the device.
    pub fn on_device(runtime: &Runtime, surfaces: Surfaces<'_>, settings: MapSettings) -> Result<Self> {
        Self::new(Memory::Device(runtime), surfaces, settings)
    }

    /// The same in any memory.
    ///
    /// # Errors
    /// Those of the device.
    pub(in crate::render) fn new(memory: Memory<'_>, surfaces: Surfaces<'_>, settings: MapSettings) -> Result<Self> {
        let shape = settings.shape();
        let mut made = Self {
            settings,
            centres: memory.zeroed("map_centres", shape.centres)?,
            texels: memory.zeroed("map_texels", shape.texels())?,
            about: Arc::default(),
        };
        if let Memory::Device(runtime) = memory {
            let start = std::time::Instant::now();
            let mut about = chosen(runtime, surfaces, settings)?;
            let choice = start.elapsed().as_secs_f64();
            made.draw(runtime, surfaces, &about.centres)?;
            about.seconds = [choice, start.elapsed().as_secs_f64() - choice];
            made.about = Arc::new(about);
        }
        Ok(made)
    }

    fn draw(&self, runtime: &Runtime, surfaces: Surfaces<'_>, centres: &[[f32; 3]]) -> Result<()> {
        let places: Vec<[f32; 4]> = centres.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        runtime.overwrite_from(&self.centres, 0, &places)?;
        let mut g = Graph::new().with_device_class(runtime.device().info().kind.into());
        let triangles = g.import_read(surfaces.triangles);
        let (centres, mut texels) = (g.import_read(&self.centres), g.import(&self.texels));
        maps::draw(
            &mut g,
            (&triangles, surfaces.count),
            (self.settings.shape(), surfaces.radius),
            &centres,
            &mut texels,
        );
        g.keep(&texels);
        runtime.prepare(&g.plan().expect("a valid plan"))?.run()
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.centres.bytes() + self.texels.bytes()
    }
}

/// Places for the centres, from the maps of all candidates.
fn chosen(runtime: &Runtime, surfaces: Surfaces<'_>, settings: MapSettings) -> Result<About> {
    let shape = settings.candidate_shape();
    let places = candidates(surfaces.bounds, shape.centres);
    let (areas, seen_by) = looked(runtime, surfaces, shape, &places)?;
    let seen = Seen { candidates: shape.centres, areas: &areas, seen_by: &seen_by };
    let choice = seen.choose(settings.centres);
    let all: Vec<u32> = (0..shape.centres).collect();
    let centres = choice.chosen.iter().map(|candidate| places[*candidate as usize]).collect();
    Ok(About { centres, covered: seen.covered(&choice.chosen, &all), choice: Some(choice), seconds: [0.0; 2] })
}

/// Areas and masks of the texels of the maps of these places.
fn looked(
    runtime: &Runtime,
    surfaces: Surfaces<'_>,
    shape: Shape,
    places: &[[f32; 3]],
) -> Result<(Vec<f32>, Vec<[u32; 2]>)> {
    let mut g = Graph::new().with_device_class(runtime.device().info().kind.into());
    let triangles = g.import_read(surfaces.triangles);
    let places: Vec<[f32; 4]> = places.iter().map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
    let (centres, mut texels) = (g.upload("candidates", &places), g.buffer("candidate_texels", shape.texels()));
    maps::draw(&mut g, (&triangles, surfaces.count), (shape, surfaces.radius), &centres, &mut texels);
    let (areas, seen_by) = maps::seen(&mut g, &triangles, Maps { shape, centres: &centres, texels: &texels });
    let (areas, seen_by) = (g.readback(&areas), g.readback(&seen_by));
    let mut executable = runtime.prepare(&g.plan().expect("a valid plan"))?;
    executable.run()?;
    Ok((executable.read(&areas), executable.read(&seen_by)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_fill_the_box() {
        let places = candidates([[-1.0, 0.0, 5.0], [1.0, 0.0, 8.0]], 48);
        assert_eq!(places.len(), 48);
        assert_eq!(candidates([[0.0; 3]; 2], 1000).len(), MAP_CANDIDATES as usize);
        for axis in 0..3 {
            let (low, high) = ([-1.0, 0.0, 5.0][axis], [1.0, 0.0, 8.0][axis]);
            let part = |p: &[f32; 3]| if high > low { (p[axis] - low) / (high - low) } else { 0.5 };
            assert!(places.iter().all(|p| (0.0..=1.0).contains(&part(p))), "axis {axis}");
            let mean = places.iter().map(part).sum::<f32>() / 48.0;
            assert!((mean - 0.5).abs() < 0.12, "axis {axis}: {mean}");
        }
        let mut sorted: Vec<u32> = places.iter().map(|p| p[0].to_bits()).collect();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), 48, "all apart");
    }
}
