//! How the time of each estimator grows with photons and with pixels.

use super::estimators::{Raced, Trial, race};
use crate::fit::{Fit, fit};
use crate::graph::Runtime;
use crate::plot::{Axis, Plot, Series};
use crate::render::Estimator;
use crate::scene::Scene;
use crate::vk::DeviceKind;

/// What grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// Photons, with the pixels of the trial.
    Photons,
    /// Pixels, with the photons of the trial.
    Pixels,
}

impl Variable {
    /// Name, for tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Photons => "photons",
            Self::Pixels => "pixels",
        }
    }
}

/// Part of the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Building the structure that the gather uses.
    Build,
    /// Gathering.
    Gather,
    /// Both.
    Sum,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Build, Self::Gather, Self::Sum];

    /// Name, for tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Build => "build",
            Self::Gather => "gather",
            Self::Sum => "sum",
        }
    }

    /// Seconds.
    pub fn of(self, raced: &Raced) -> f64 {
        match self {
            Self::Build => raced.times.build,
            Self::Gather => raced.times.gather,
            Self::Sum => raced.times.total,
        }
    }
}

/// Sizes that are tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Numbers of photons emitted, ascending.
    pub photons: Vec<u32>,
    /// Sizes of the picture, ascending.
    pub pixels: Vec<[u32; 2]>,
    /// Seconds of building and gathering after which larger sizes are not tried.
    pub longest: f64,
}

impl Sizes {
    /// 10^4 to 10^7 photons in half decades; 80 x 45 to 1280 x 720 pixels on software devices, up to 3840 x 2160 on
    /// others.
    pub fn full(runtime: &Runtime) -> Self {
        let software = runtime.device().info().kind == DeviceKind::Software;
        let factors: &[u32] = if software { &[1, 2, 4, 8, 16] } else { &[4, 8, 16, 24, 48] };
        let pixels = factors.iter().map(|k| [80 * k, 45 * k]).collect();
        let photons = vec![10_000, 31_623, 100_000, 316_228, 1_000_000, 3_162_278, 10_000_000];
        Self { photons, pixels, longest: 10.0 }
    }

    /// Just enough to see that it runs; the numbers mean nothing.
    pub fn quick() -> Self {
        Self { photons: vec![500, 1000, 2000], pixels: vec![[16, 9], [32, 18]], longest: 10.0 }
    }
}

/// One size.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Photons that were to be emitted.
    pub photons: u32,
    /// Size of the picture.
    pub size: [u32; 2],
    /// The measured points, or the reason why there are none.
    pub outcome: std::result::Result<Raced, String>,
}

/// An estimator over sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The estimator.
    pub estimator: Estimator,
    /// What grows.
    pub variable: Variable,
    /// By size.
    pub steps: Vec<Step>,
}

impl Curve {
    /// Measured points: photons stored, or pixels; seconds.
    pub fn points(&self, part: Part) -> Vec<(f64, f64)> {
        let point = |step: &Step| {
            let raced = step.outcome.as_ref().ok()?;
            let x = match self.variable {
                Variable::Photons => raced.stored as f64,
                Variable::Pixels => f64::from(step.size[0]) * f64::from(step.size[1]),
            };
            Some((x, part.of(raced)))
        };
        self.steps.iter().filter_map(point).collect()
    }

    /// Growth as a power.
    pub fn fit(&self, part: Part) -> Option<Fit> {
        fit(&self.points(part))
    }
}

/// Curves of one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Growth {
    /// Its file, or what it is.
    pub name: String,
    /// Photons emitted where pixels grow.
    pub photons: u32,
    /// Size of the picture where photons grow.
    pub size: [u32; 2],
    /// Photons first, then pixels; estimators in the order of [`Trial::estimators`].
    pub curves: Vec<Curve>,
}

impl Growth {
    /// Curves over one variable.
    pub fn over(&self, variable: Variable) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(move |curve| curve.variable == variable)
    }

    /// Milliseconds of every estimator over one variable, both axes logarithmic.
    pub fn plot(&self, variable: Variable, part: Part) -> Plot {
        let (label, rest) = match variable {
            Variable::Photons => ("photons stored", format!("{}x{} pixels", self.size[0], self.size[1])),
            Variable::Pixels => ("pixels", format!("{} photons emitted", self.photons)),
        };
        let what = match part {
            Part::Build => "building",
            Part::Gather => "gathering",
            Part::Sum => "building and gathering",
        };
        let series = |curve: &Curve| {
            let exponent = curve.fit(part).map_or(String::new(), |fit| format!(": n^{:.2}", fit.exponent));
            let points = curve.points(part).into_iter().map(|(x, seconds)| (x, 1e3 * seconds)).collect();
            Series::new(format!("{}{exponent}", curve.estimator.name()), points)
        };
        Plot {
            title: format!("{}: {what}, {rest}", self.name),
            x: Axis::logarithmic(label),
            y: Axis::logarithmic("milliseconds"),
            series: self.over(variable).map(series).collect(),
        }
    }
}

/// Measures `scene` at every size. An estimator that failed or took too long at one size is not tried at the next.
/// `begin` hears what comes next.
pub fn growth(
    runtime: &Runtime,
    scene: &Scene,
    (trial, sizes): (&Trial, &Sizes),
    begin: &mut dyn FnMut(&str),
) -> Growth {
    let name = scene.path.display().to_string();
    // By default the number of photons follows from the pixels; here only one of the two may grow.
    let photons = trial.estimators.first().map_or(0, |&first| trial.settings(first).photon_count());
    let mut curves = Vec::new();
    for variable in [Variable::Photons, Variable::Pixels] {
        let places: Vec<(u32, [u32; 2])> = match variable {
            Variable::Photons => sizes.photons.iter().map(|&n| (n, trial.size)).collect(),
            Variable::Pixels => sizes.pixels.iter().map(|&size| (photons, size)).collect(),
        };
        let first = curves.len();
        curves.extend(trial.estimators.iter().map(|&estimator| Curve { estimator, variable, steps: vec![] }));
        for (photons, size) in places {
            let here = format!("{name}, {photons} photons, {}x{}", size[0], size[1]);
            let trial = Trial { photons: Some(photons), size, ..trial.clone() };
            let mut running: Vec<&mut Curve> =
                curves[first..].iter_mut().filter(|curve| goes_on(curve, sizes.longest)).collect();
            let kinds = running.iter().map(|curve| trial.settings(curve.estimator)).collect();
            let outcomes = race(runtime, scene, &trial, kinds, &mut |what| begin(&format!("{here}: {what}")));
            for (curve, outcome) in running.iter_mut().zip(outcomes) {
                curve.steps.push(Step { photons, size, outcome });
            }
        }
    }
    Growth { name, photons, size: trial.size, curves }
}

fn goes_on(curve: &Curve, longest: f64) -> bool {
    curve.steps.last().is_none_or(|step| step.outcome.as_ref().is_ok_and(|raced| raced.times.total <= longest))
}

#[cfg(test)]
mod tests {
    use super::super::estimators::Times;
    use super::*;

    fn step(stored: u64, gather: f64) -> Step {
        let times = Times { build: 0.001, gather, total: 0.001 + gather, spread: 1.0 };
        let raced = Raced { times, emitted: 2 * stored, stored, transient_bytes: 0, bytes: None };
        Step { photons: 2 * stored as u32, size: [4, 4], outcome: Ok(raced) }
    }

    fn curve() -> Curve {
        let steps = vec![step(100, 0.1), step(1000, 1.0), step(10_000, 10.0)];
        Curve { estimator: Estimator::Bvh, variable: Variable::Photons, steps }
    }

    #[test]
    fn growth_is_that_of_the_photons_stored() {
        let curve = curve();
        assert!((curve.fit(Part::Gather).expect("a fit").exponent - 1.0).abs() < 1e-12);
        assert!(curve.fit(Part::Build).expect("a fit").exponent.abs() < 1e-12);
        let mut pixels = curve.clone();
        pixels.variable = Variable::Pixels;
        assert_eq!(pixels.fit(Part::Gather), None, "the pixels were the same");
    }

    #[test]
    fn a_slow_or_broken_estimator_is_not_carried_on() {
        let mut curve = curve();
        assert!(goes_on(&curve, 11.0) && !goes_on(&curve, 10.0));
        curve.steps.push(Step { outcome: Err("full".into()), ..step(1, 0.1) });
        assert!(!goes_on(&curve, 11.0));
        curve.steps.clear();
        assert!(goes_on(&curve, 0.0));
    }

    #[test]
    fn a_plot_has_as_many_points_as_were_measured() {
        let mut curve = curve();
        curve.steps.push(Step { outcome: Err("full".into()), ..step(1, 0.1) });
        let growth = Growth { name: "a<b>.glb".into(), photons: 5, size: [4, 4], curves: vec![curve] };
        let svg = growth.plot(Variable::Photons, Part::Gather).svg();
        assert_eq!(svg.matches("class=\"point\"").count(), 3);
        assert!(svg.contains("a&lt;b&gt;.glb: gathering") && svg.contains("bvh: n^1.00"), "{svg}");
        assert_eq!(growth.plot(Variable::Pixels, Part::Gather).svg().matches("class=\"point\"").count(), 0);
    }
}
