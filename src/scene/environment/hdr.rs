//! Radiance pictures (`.hdr`, `.pic`): G. Ward, "Radiance Picture File Format"; `color.c` and `resolu.c` of Radiance.

use super::canvas::Canvas;
use super::color::{self, Chromaticities};
use super::read::{Outcome, Reading, shown};

/// Lengths of rows for which runs of each byte plane exist.
const PLANE_RUNS: std::ops::Range<u64> = 8..0x8000;

/// Lines of a header; histories of processing are long, but not endless.
const MOST_LINES: usize = 10_000;

/// What the header says.
struct Header {
    /// What values are to be divided by, for red, green and blue.
    exposure: [f64; 3],
    chromaticities: Option<Chromaticities>,
    xyz: bool,
}

/// How rows of the file lie in the picture.
struct Orientation {
    /// Rows of the file: number, whether they are columns of the picture, whether they run against its axis.
    major: Axis,
    minor: Axis,
}

struct Axis {
    length: u64,
    horizontal: bool,
    reversed: bool,
}

impl Axis {
    /// From the picture's left or top.
    fn place(&self, index: u64) -> i64 {
        (if self.reversed { self.length - 1 - index } else { index }) as i64
    }
}

/// Whether a file begins as Radiance pictures do.
pub(super) fn is_ours(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?")
}

/// Reads the picture in `bytes`.
pub(super) fn decode(bytes: &[u8], reading: &mut Reading) -> Outcome<Canvas> {
    let mut input = Input { bytes };
    let header = Header::read(&mut input, reading)?;
    let Orientation { major, minor } = Orientation::parse(input.line()?)?;
    let sides = [major.length, minor.length];
    let [width, height] = if minor.horizontal { [sides[1], sides[0]] } else { sides };
    let converted = header.colors(reading);
    let mut canvas = reading.canvas([width, height], converted)?;
    let mut row = Vec::new();
    for line in 0..major.length {
        input.row(minor.length, &mut row)?;
        for (at, &packed) in (0..).zip(&row) {
            let places = [minor.place(at), major.place(line)];
            let [x, y] = if minor.horizontal { places } else { [places[1], places[0]] };
            canvas.set(x, y, header.radiance(packed));
        }
    }
    Ok(canvas)
}

impl Header {
    fn read(input: &mut Input<'_>, reading: &mut Reading) -> Outcome<Self> {
        let mut header = Self { exposure: [1.0; 3], chromaticities: None, xyz: false };
        for _ in 0..MOST_LINES {
            let line = input.line()?;
            if line.is_empty() {
                return Ok(header);
            }
            header.take(&String::from_utf8_lossy(line), reading)?;
        }
        Err("damaged Radiance HDR: its header does not end".into())
    }

    /// One line. Those of pictures that this one was made of are indented, and so not taken.
    fn take(&mut self, line: &str, reading: &mut Reading) -> Outcome<()> {
        let Some((name, value)) = line.split_once('=') else { return Ok(()) };
        match name {
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => self.xyz = false,
                "32-bit_rle_xyze" => self.xyz = true,
                other => return Err(format!("Radiance HDR of format '{}' is not supported", shown(other))),
            },
            // Factors of several lines multiply.
            "EXPOSURE" => match numbers::<1>(value).filter(positive) {
                Some([factor]) => self.exposure = self.exposure.map(|known| known * factor),
                None => reading.fault(format!("environment: EXPOSURE '{}' is ignored", shown(value))),
            },
            "COLORCORR" => match numbers::<3>(value).filter(positive) {
                Some(factors) => self.exposure = std::array::from_fn(|k| self.exposure[k] * factors[k]),
                None => reading.fault(format!("environment: COLORCORR '{}' is ignored", shown(value))),
            },
            "PRIMARIES" => match numbers::<8>(value) {
                Some(numbers) => self.chromaticities = Some(numbers.map(|number| number as f32)),
                None => reading.fault(format!("environment: PRIMARIES '{}' are ignored", shown(value))),
            },
            _ => {}
        }
        Ok(())
    }

    /// The primaries, if they are not the usual ones.
    fn colors(&self, reading: &mut Reading) -> Option<glam::Mat3> {
        let chromaticities = match self.chromaticities {
            _ if self.xyz => color::XYZ,
            Some(known) if !color::same(&known, &color::RADIANCE) => known,
            _ => return None,
        };
        reading.conversion(&chromaticities)
    }

    /// Mantissas with a common exponent (`colr_color` without its half step, as most programs read it).
    fn radiance(&self, [r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
        if exponent == 0 {
            return [0.0; 3];
        }
        // 2 to the power of the exponent less 136, exactly.
        let scale = f64::from_bits((u64::from(exponent) + 1023 - 136) << 52);
        let mantissas = [r, g, b].map(f64::from);
        std::array::from_fn(|k| (mantissas[k] * scale / self.exposure[k]) as f32)
    }
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    numbers?.try_into().ok()
}

fn positive<const N: usize>(numbers: &[f64; N]) -> bool {
    numbers.iter().all(|number| *number > 0.0 && number.is_finite())
}

impl Orientation {
    /// `-Y 512 +X 1024`: the axis of rows first; +X is right, +Y is up.
    fn parse(line: &[u8]) -> Outcome<Self> {
        let text = String::from_utf8_lossy(line);
        let words: Vec<&str> = text.split_whitespace().collect();
        let axis = |sign: &str, length: &str| {
            let length = length.parse().ok().filter(|length| *length > 0)?;
            let (horizontal, reversed) = match sign {
                "+X" => (true, false),
                "-X" => (true, true),
                "-Y" => (false, false),
                "+Y" => (false, true),
                _ => return None,
            };
            Some(Axis { length, horizontal, reversed })
        };
        let axes = match words[..] {
            [a, m, b, n] => axis(a, m).zip(axis(b, n)).filter(|(a, b)| a.horizontal != b.horizontal),
            _ => None,
        };
        let (major, minor) =
            axes.ok_or_else(|| format!("damaged Radiance HDR: size and orientation '{}'", shown(&text)))?;
        Ok(Self { major, minor })
    }
}

/// The bytes that are left.
struct Input<'a> {
    bytes: &'a [u8],
}

impl<'a> Input<'a> {
    fn take(&mut self, count: usize) -> Outcome<&'a [u8]> {
        let (taken, left) = self.bytes.split_at_checked(count).ok_or("damaged Radiance HDR: it ends too early")?;
        self.bytes = left;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Outcome<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// A line without its end, which is LF or CR LF.
    fn line(&mut self) -> Outcome<&'a [u8]> {
        let end = self.bytes.iter().position(|byte| *byte == b'\n');
        let line = self.take(end.map_or(usize::MAX, |end| end + 1))?;
        let line = &line[..line.len() - 1];
        Ok(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// A row of `length` pixels.
    fn row(&mut self, length: u64, row: &mut Vec<[u8; 4]>) -> Outcome<()> {
        row.clear();
        match self.bytes {
            [2, 2, high, low, ..] if PLANE_RUNS.contains(&length) && *high < 128 => {
                let says = u64::from(*high) << 8 | u64::from(*low);
                if says != length {
                    return Err(format!("damaged Radiance HDR: a row of {says} pixels, not {length}"));
                }
                self.take(4)?;
                self.planes(length as usize, row)
            }
            _ => self.pixel_runs(length as usize, row),
        }
    }

    /// Each byte plane by itself, in runs and pieces.
    fn planes(&mut self, length: usize, row: &mut Vec<[u8; 4]>) -> Outcome<()> {
        row.resize(length, [0; 4]);
        for plane in 0..4 {
            let mut at = 0;
            while at < length {
                let [code] = self.array()?;
                let count = usize::from(if code > 128 { code - 128 } else { code });
                let pixels = row.get_mut(at..at + count).filter(|_| count > 0);
                let pixels = pixels.ok_or("damaged Radiance HDR: runs that do not fill a row")?;
                if code > 128 {
                    let [byte] = self.array()?;
                    pixels.iter_mut().for_each(|pixel| pixel[plane] = byte);
                } else {
                    pixels.iter_mut().zip(self.take(count)?).for_each(|(pixel, byte)| pixel[plane] = *byte);
                }
                at += count;
            }
        }
        Ok(())
    }

    /// Whole pixels; (1, 1, 1, n) repeats the one before n times, and further ones at once 256 n times and so on.
    fn pixel_runs(&mut self, length: usize, row: &mut Vec<[u8; 4]>) -> Outcome<()> {
        let mut shift = 0;
        while row.len() < length {
            match self.array()? {
                [1, 1, 1, count] => {
                    let last = *row.last().ok_or("damaged Radiance HDR: a run without a pixel")?;
                    // Runs end with their row.
                    let count = usize::from(count).checked_shl(shift).unwrap_or(usize::MAX);
                    row.resize(row.len() + count.min(length - row.len()), last);
                    shift = (shift + 8).min(usize::BITS - 8);
                }
                pixel => {
                    row.push(pixel);
                    shift = 0;
                }
            }
        }
        Ok(())
    }
}
