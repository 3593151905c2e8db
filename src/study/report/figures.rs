//! The plots of a scene.

use std::collections::BTreeMap;

use super::costs::time_bars;
use super::errors::slope_text;
use crate::plot::{Axis, Plot, Series};
use crate::study::curves::{Cell, Cost, Measure, peer_curve, peers, scenes, variants};
use crate::study::results::{Decomposition, Results};
use crate::study::statistics::slope;

/// A plot and the name of its file.
pub(super) struct Figure {
    /// Where it stands on the page.
    pub kind: Kind,
    /// For example `ring-trimmed-seconds.svg`.
    pub file: String,
    /// The document.
    pub svg: String,
}

/// What a plot shows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Error against cost.
    Error,
    /// Bias and variance.
    Parts,
    /// Time split.
    Time,
}

/// The plots of all scenes, by scene.
pub(super) fn figures(results: &Results) -> Vec<Vec<Figure>> {
    let scenes = scenes(results);
    scenes.iter().zip(slugs(&scenes)).map(|(scene, slug)| of_scene(results, scene, &slug)).collect()
}

/// Names for files: small letters, digits and dashes, each once.
fn slugs(scenes: &[String]) -> Vec<String> {
    let mut slugs: Vec<String> = Vec::new();
    for scene in scenes {
        let simple = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
        let text: String = scene.chars().map(simple).take(48).collect();
        let text = text.trim_matches('-').to_owned();
        let base = if text.is_empty() { "scene".to_owned() } else { text };
        let numbered = (2..).map(|n| format!("{base}-{n}"));
        let free = std::iter::once(base.clone()).chain(numbered).find(|name| !slugs.contains(name));
        slugs.push(free.unwrap_or(base)); // there is always a free one
    }
    slugs
}

fn of_scene(results: &Results, scene: &str, slug: &str) -> Vec<Figure> {
    let mut figures = Vec::new();
    for measure in Measure::ALL {
        for cost in Cost::ALL {
            let plot = work_precision(results, scene, cost, measure);
            if plot.series.iter().any(|series| !series.points.is_empty()) {
                let file = format!("{slug}-{}-{}.svg", measure.name(), cost.name());
                figures.push(Figure { kind: Kind::Error, file, svg: plot.svg() });
            }
        }
    }
    if let Some(bars) = time_bars(results, scene) {
        figures.push(Figure { kind: Kind::Time, file: format!("{slug}-time-split.svg"), svg: bars.svg() });
    }
    let parts: Vec<&Decomposition> = results.decompositions.iter().filter(|d| d.scene == scene).collect();
    for (name, plot) in decompositions(results, scene, &parts) {
        let file = format!("{slug}-bias-variance-{name}.svg");
        figures.push(Figure { kind: Kind::Parts, file, svg: plot.svg() });
    }
    figures
}

/// Error against cost: medians with bands, others dashed.
fn work_precision(results: &Results, scene: &str, cost: Cost, measure: Measure) -> Plot {
    let (variants, peers) = (variants(results), peers(results));
    let mut series = Vec::new();
    for (look, variant) in variants.iter().enumerate() {
        let cell = Cell::of(results, scene, variant);
        let points = cell.points(cost, measure);
        // A method without photons has no place on an axis of photons.
        if points.iter().all(|p| p.x.median == 0.0) {
            continue;
        }
        series.push(Series {
            note: slope(&cell.runs(cost, measure)).map(|s| format!("slope {}", slope_text(&s))),
            band: points.iter().map(|p| (p.x.median, p.y.low, p.y.high)).collect(),
            look: Some(look),
            ..Series::new(variant.as_str(), points.iter().map(|p| (p.x.median, p.y.median)).collect())
        });
    }
    for (index, peer) in peers.iter().enumerate().filter(|_| cost == Cost::Seconds) {
        let points = peer_curve(results, scene, peer, measure);
        if !points.is_empty() {
            let look = Some(variants.len() + index);
            series.push(Series { look, dashed: true, ..Series::new(peer.as_str(), points) });
        }
    }
    let title = format!("{scene}: error against {}", cost.name());
    Plot { title, x: Axis::logarithmic(cost.label()), y: Axis::logarithmic(measure.label()), series }
}

/// Bias and variance against passes where they differ, and against a setting that is a radius where it differs.
fn decompositions(results: &Results, scene: &str, parts: &[&Decomposition]) -> Vec<(&'static str, Plot)> {
    let mut plots = Vec::new();
    let radius = radius_key(parts);
    if let Some(key) = &radius {
        plots.push(("radius", parts_plot(scene, Axis::logarithmic(key.as_str()), by_radius(parts, key))));
    }
    let passes = parts.iter().any(|d| d.passes != parts[0].passes);
    if passes || (!parts.is_empty() && radius.is_none()) {
        let of = |variant: &String| {
            let mine = parts.iter().filter(|d| d.variant == *variant);
            mine.map(|d| (d.passes as f64, *d)).collect::<Vec<_>>()
        };
        let lines: Vec<Line> = variants(results).iter().map(|variant| (variant.clone(), of(variant))).collect();
        plots.push(("passes", parts_plot(scene, Axis::logarithmic("passes"), lines)));
    }
    plots
}

/// A name with the parts along x.
type Line<'a> = (String, Vec<(f64, &'a Decomposition)>);

/// Bias or variance.
type Part = fn(&Decomposition) -> f64;

/// Settings by name, and passes.
type Group<'a> = (BTreeMap<&'a str, &'a str>, u64);

fn number(text: &str) -> Option<f64> {
    text.split_whitespace().next()?.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0)
}

/// The first setting named a radius that is a number everywhere it stands and differs.
fn radius_key(parts: &[&Decomposition]) -> Option<String> {
    let keys: BTreeMap<&String, Vec<&String>> =
        parts.iter().flat_map(|d| &d.settings).fold(BTreeMap::new(), |mut keys, (key, value)| {
            keys.entry(key).or_insert_with(Vec::new).push(value);
            keys
        });
    let fits = |values: &[&String]| {
        let numbers: Option<Vec<f64>> = values.iter().map(|v| number(v)).collect();
        numbers.is_some_and(|n| n.iter().any(|v| *v != n[0]))
    };
    keys.into_iter().find(|(key, values)| key.to_lowercase().contains("radius") && fits(values)).map(|(k, _)| k.clone())
}

/// Lines of those that differ in the radius only.
fn by_radius<'a>(parts: &[&'a Decomposition], key: &str) -> Vec<Line<'a>> {
    let mut groups: BTreeMap<Group, Vec<(f64, &Decomposition)>> = BTreeMap::new();
    for part in parts {
        let Some(radius) = part.settings.get(key).and_then(|text| number(text)) else { continue };
        let others = part.settings.iter().filter(|(k, _)| *k != key).map(|(k, v)| (k.as_str(), v.as_str()));
        groups.entry((others.collect(), part.passes)).or_default().push((radius, part));
    }
    let shared = |name: &str, value: &str| groups.keys().all(|(settings, _)| settings.get(name) == Some(&value));
    let named = groups.iter().map(|((settings, passes), line)| {
        let telling = settings.iter().filter(|(name, value)| !shared(name, value)).map(|(n, v)| format!("{n}={v}"));
        (telling.chain([format!("{passes} passes")]).collect::<Vec<_>>().join(" "), line.clone())
    });
    named.collect()
}

fn parts_plot(scene: &str, x: Axis, lines: Vec<Line>) -> Plot {
    let mut series = Vec::new();
    for (look, (name, mut line)) in lines.into_iter().enumerate() {
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        let of: [(&str, bool, Part); 2] =
            [("bias\u{b2}", false, |d| d.bias_squared), ("variance", true, |d| d.variance)];
        for (part, dashed, value) in of.into_iter().filter(|_| !line.is_empty()) {
            let points: Vec<(f64, f64)> = line.iter().map(|(x, d)| (*x, value(d))).collect();
            let note = slope(std::slice::from_ref(&points)).map(|s| format!("slope {}", slope_text(&s)));
            let named = Series::new(format!("{part}: {name}"), points);
            series.push(Series { note, look: Some(look), dashed, ..named });
        }
    }
    let y = Axis::logarithmic("relative squared error, mean over the pixels");
    Plot { title: format!("{scene}: bias\u{b2} and variance against {}", x.label), x, y, series }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_names_are_harmless_and_different() {
        let names = ["../a b", "a/b", "", "<script>", "\u{4e2d}", "A-B", "a-b-2"].map(str::to_owned);
        assert_eq!(slugs(&names), ["a-b", "a-b-2", "scene", "script", "scene-2", "a-b-3", "a-b-2-2"]);
    }

    fn part(radius: &str, estimator: &str, bias_squared: f64) -> Decomposition {
        let settings = [("first-radius", radius), ("estimator", estimator)];
        Decomposition {
            scene: "s".into(),
            variant: format!("{estimator} {radius}"),
            settings: settings.map(|(k, v)| (k.to_owned(), v.to_owned())).into(),
            passes: 64,
            seeds: 16,
            bias_squared,
            variance: 1.0,
        }
    }

    /// Bias grows with the fourth power of the radius.
    #[test]
    fn a_radius_is_found_among_the_settings() {
        let parts = [part("0.1", "a", 1e-4), part("0.2 m", "a", 16e-4), part("0.1", "b", 1.0), part("0.2", "b", 1.0)];
        let parts: Vec<_> = parts.iter().collect();
        let plots = decompositions(&Results::default(), "s", &parts);
        let [("radius", plot)] = &plots[..] else { panic!("one plot") };
        let names: Vec<_> = plot.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names[0], "bias\u{b2}: estimator=a 64 passes");
        assert_eq!(names.len(), 4);
        assert_eq!(plot.series[0].note.as_deref(), Some("slope 4.00"));
        let text = part("auto", "a", 1.0);
        assert_eq!(radius_key(&[parts[0], parts[1], &text]), None, "not a number");
        assert_eq!(radius_key(&[parts[0], parts[2]]), None, "always the same");
    }
}
