//! Flags of the lens, and of what is done to a picture after its last pass.

use clap::{Args, ValueEnum};

use crate::error::Error;
use crate::picture::post::bloom::Bloom;
use crate::picture::post::display::Display;
use crate::picture::post::grade::Cdl;
use crate::picture::post::ssao::Ssao;
use crate::picture::tonemap::ToneMap;
use crate::render::Lens;
use crate::scene::{Camera, Projection};

/// Size of an aperture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aperture {
    /// The N of f/N, for a full-frame camera.
    FNumber(f32),
    /// Radius in scene units.
    Radius(f32),
}

/// How depth of field is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum DepthOfField {
    /// By a thin lens in the eye paths: right, also in mirrors and behind edges
    #[default]
    Lens,
    /// By a blur after the render, from the depths: the picture stays free of the noise of a lens, edges and
    /// reflections are guesses, blur is at most 5 % of the height
    Screen,
}

/// The camera's lens.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Picture")]
pub struct LensArgs {
    /// Depth of field: aperture as f/N (such as f/2.8, of a camera with a sensor 24 mm high; a scene unit is a metre)
    /// or as a radius in scene units. Needs --focus and a perspective camera [default: a pinhole, sharp everywhere]
    #[arg(long, value_name = "f/N|RADIUS", value_parser = aperture, requires = "focus", allow_negative_numbers = true)]
    pub aperture: Option<Aperture>,

    /// Distance of what is sharp, along the view axis in scene units (as in the layer depth)
    #[arg(long, value_name = "DISTANCE", value_parser = length, requires = "aperture", allow_negative_numbers = true)]
    pub focus: Option<f32>,

    /// How depth of field is made
    #[arg(long, value_name = "HOW", value_enum, default_value_t, requires = "aperture")]
    pub depth_of_field: DepthOfField,
}

impl LensArgs {
    /// The lens that the flags ask of this camera.
    ///
    /// # Errors
    /// [`Error::Usage`] for a camera that is not a perspective one.
    pub fn lens(&self, camera: &Camera) -> crate::error::Result<Option<Lens>> {
        let (Some(aperture), Some(focus)) = (self.aperture, self.focus) else { return Ok(None) };
        let Projection::Perspective { yfov, .. } = camera.projection else {
            return Err(Error::Usage(format!(
                "--aperture needs a perspective camera, and '{}' is orthographic",
                camera.name
            )));
        };
        Ok(Some(match aperture {
            Aperture::FNumber(number) => Lens::from_f_number(number, focus, yfov),
            Aperture::Radius(radius) => Lens { radius, focus },
        }))
    }
}

/// Optional passes over the finished picture.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "After the render")]
pub struct PostArgs {
    /// Ambient occlusion in screen space: surfaces within RADIUS (scene units) of each other darken their indirect
    /// light. Only for indirect light that is subsampled and has lost its corners: with all photons they are there
    /// already, and this counts them twice
    #[arg(long, value_name = "RADIUS", value_parser = length, allow_negative_numbers = true)]
    pub ssao: Option<f32>,

    /// Factor on the darkening of --ssao
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = factor, requires = "ssao")]
    #[arg(hide_short_help = true, allow_negative_numbers = true)]
    pub ssao_strength: f32,

    /// Bloom: fraction of all light that is spread around its place, such as 0.05; no light is added or lost
    #[arg(long, value_name = "FRACTION", value_parser = fraction, allow_negative_numbers = true)]
    pub bloom: Option<f32>,

    /// Width of the bloom: standard deviation of its widest part, as a fraction of the picture's height
    #[arg(long, value_name = "FRACTION", default_value = "0.08", value_parser = fraction, requires = "bloom")]
    #[arg(hide_short_help = true, allow_negative_numbers = true)]
    pub bloom_size: f32,

    /// Grading of a PNG by ASC CDL, after the tone curve: factor on display values, one number or R,G,B
    #[arg(long = "cdl-slope", value_name = "R,G,B", value_parser = slope, allow_negative_numbers = true)]
    pub slope: Option<Triple>,

    /// The same: added to display values (lift)
    #[arg(long = "cdl-offset", value_name = "R,G,B", value_parser = offset, allow_negative_numbers = true)]
    pub offset: Option<Triple>,

    /// The same: exponent of display values; above 1 darkens the middle tones
    #[arg(long = "cdl-power", value_name = "R,G,B", value_parser = power, allow_negative_numbers = true)]
    pub power: Option<Triple>,

    /// The same, last: 0 is grey, 1 leaves colours alone
    #[arg(long, value_name = "FACTOR", value_parser = factor, allow_negative_numbers = true)]
    pub saturation: Option<f32>,

    /// Smooth the stairs of edges in a PNG: for pictures of few passes, many smooth them by themselves
    #[arg(long)]
    pub antialias: bool,
}

/// Three numbers, for red, green and blue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triple(pub [f32; 3]);

impl PostArgs {
    /// The ambient occlusion that was asked for.
    pub fn occlusion(&self) -> Option<Ssao> {
        self.ssao.map(|radius| Ssao { radius, strength: self.ssao_strength })
    }

    /// The bloom that was asked for.
    pub fn glow(&self) -> Option<Bloom> {
        self.bloom.map(|amount| Bloom { amount, size: self.bloom_size })
    }

    /// What a PNG shows.
    pub fn display(&self, map: ToneMap) -> Display {
        let neutral = Cdl::default();
        let list = |triple: Option<Triple>, otherwise| triple.map_or(otherwise, |triple| triple.0);
        let cdl = Cdl {
            slope: list(self.slope, neutral.slope),
            offset: list(self.offset, neutral.offset),
            power: list(self.power, neutral.power),
            saturation: self.saturation.unwrap_or(neutral.saturation),
        };
        Display { map, grade: (cdl != neutral).then_some(cdl), antialias: self.antialias }
    }
}

type Parsed<T> = Result<T, String>;

/// Parses `f/2.8` or a radius.
fn aperture(text: &str) -> Parsed<Aperture> {
    let number = |text: &str| text.parse::<f32>().ok().filter(|x| (1e-6..=1e6).contains(x));
    let parsed = match text.strip_prefix(['f', 'F']).and_then(|rest| rest.strip_prefix('/')) {
        Some(rest) => number(rest).map(Aperture::FNumber),
        None => number(text).map(Aperture::Radius),
    };
    parsed.ok_or_else(|| "expected f/N or a radius in scene units, for example f/2.8 or 0.05".into())
}

/// Parses a length in scene units.
fn length(text: &str) -> Parsed<f32> {
    let length = text.parse::<f32>().ok().filter(|x| (1e-30..=1e30).contains(x));
    length.ok_or_else(|| "expected a length in scene units greater than 0, for example 2.5".into())
}

fn between(text: &str, [least, most]: [f32; 2]) -> Parsed<f32> {
    let number = text.parse::<f32>().ok().filter(|x| (least..=most).contains(x));
    number.ok_or_else(|| format!("expected a number between {least} and {most}"))
}

fn fraction(text: &str) -> Parsed<f32> {
    between(text, [0.0, 1.0])
}

fn factor(text: &str) -> Parsed<f32> {
    between(text, [0.0, 100.0])
}

/// One number for all three, or three of them.
fn triple(text: &str, range: [f32; 2]) -> Parsed<Triple> {
    let numbers: Vec<f32> = text.split(',').map(|part| between(part, range)).collect::<Parsed<_>>()?;
    match numbers[..] {
        [all] => Ok(Triple([all; 3])),
        [r, g, b] => Ok(Triple([r, g, b])),
        _ => Err("expected one number, or three with commas between them: R,G,B".into()),
    }
}

fn slope(text: &str) -> Parsed<Triple> {
    triple(text, [0.0, 100.0])
}

fn offset(text: &str) -> Parsed<Triple> {
    triple(text, [-10.0, 10.0])
}

fn power(text: &str) -> Parsed<Triple> {
    triple(text, [0.01, 100.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        lens: LensArgs,
        #[command(flatten)]
        post: PostArgs,
    }

    fn parse(line: &str) -> Result<Line, String> {
        let words = std::iter::once("nephroid").chain(line.split_whitespace());
        Line::try_parse_from(words).map_err(|error| error.to_string())
    }

    fn accepted(line: &str) -> Line {
        parse(line).unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    #[test]
    fn nothing_is_on_by_default() {
        let Line { lens, post } = accepted("");
        assert_eq!((lens.aperture, lens.focus, lens.depth_of_field), (None, None, DepthOfField::Lens));
        assert_eq!((post.occlusion(), post.glow()), (None, None));
        assert_eq!(post.display(ToneMap::default()), Display::from(ToneMap::default()));
    }

    #[test]
    fn values_reach_the_passes() {
        let line = "--aperture f/2.8 --focus 3 --depth-of-field screen --ssao 0.5 --ssao-strength 2 --bloom 0.1 \
                    --bloom-size 0.2 --cdl-slope 1.1,1,0.9 --cdl-offset -0.1 --cdl-power 2 --saturation 0.5 \
                    --antialias";
        let Line { lens, post } = accepted(line);
        assert_eq!((lens.aperture, lens.focus), (Some(Aperture::FNumber(2.8)), Some(3.0)));
        assert_eq!(lens.depth_of_field, DepthOfField::Screen);
        assert_eq!(post.occlusion(), Some(Ssao { radius: 0.5, strength: 2.0 }));
        assert_eq!(post.glow(), Some(Bloom { amount: 0.1, size: 0.2 }));
        let cdl = Cdl { slope: [1.1, 1.0, 0.9], offset: [-0.1; 3], power: [2.0; 3], saturation: 0.5 };
        let display = post.display(ToneMap::default());
        assert_eq!((display.grade, display.antialias), (Some(cdl), true));
        assert_eq!(accepted("--aperture 0.05 --focus 1e-3").lens.aperture, Some(Aperture::Radius(0.05)));
    }

    #[test]
    fn bad_values_are_refused_with_a_reason() {
        for (line, part) in [
            ("--aperture 2.8", "--focus"),
            ("--focus 3", "--aperture"),
            ("--depth-of-field screen", "--aperture"),
            ("--aperture f/0 --focus 3", "expected f/N"),
            ("--aperture f2.8 --focus 3", "expected f/N"),
            ("--aperture 0 --focus 3", "expected f/N"),
            ("--aperture nan --focus 3", "expected f/N"),
            ("--aperture f/2 --focus 0", "expected a length"),
            ("--aperture f/2 --focus -1", "expected a length"),
            ("--aperture f/2 --focus inf", "expected a length"),
            ("--aperture f/2 --focus 1 --depth-of-field both", "possible values"),
            ("--ssao 0", "expected a length"),
            ("--ssao-strength 1", "--ssao"),
            ("--bloom 1.5", "between 0 and 1"),
            ("--bloom nan", "between 0 and 1"),
            ("--bloom-size 0.1", "--bloom"),
            ("--cdl-slope 1,2", "expected one number, or three"),
            ("--cdl-slope -1", "between 0 and 100"),
            ("--cdl-offset 11", "between -10 and 10"),
            ("--cdl-power 0", "between 0.01 and 100"),
            ("--saturation -1", "between 0 and 100"),
        ] {
            let message = parse(line).err().unwrap_or_else(|| panic!("{line} was taken"));
            assert!(message.contains(part), "{line}: {message}");
        }
    }
}
