//! Values over time, by the rules of glTF 2.0 (section 3.11 and appendix C).

use glam::DQuat;

/// How values between two keys follow from them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::scene) enum Interpolation {
    /// The value of the earlier key.
    Step,
    /// A straight line; for rotations the shorter arc.
    Linear,
    /// A cubic Hermite spline through values with tangents: an in-tangent, the value, an out-tangent for each key.
    CubicSpline,
}

/// What kind of values a sampler has: rotations follow arcs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum Kind {
    /// Unit quaternions x, y, z, w.
    Rotation,
    /// So many numbers, each by itself.
    Numbers(usize),
}

/// Keys of one property.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) struct Sampler {
    /// Seconds, in order.
    times: Vec<f32>,
    /// Values of all keys, one after the other.
    values: Vec<f32>,
    interpolation: Interpolation,
    kind: Kind,
}

impl Kind {
    fn width(self) -> usize {
        match self {
            Self::Rotation => 4,
            Self::Numbers(width) => width,
        }
    }
}

impl Sampler {
    /// A sampler of these keys, with what is wrong with them if they can be read around; fails with what is wrong
    /// otherwise.
    pub fn new(
        mut times: Vec<f32>,
        mut values: Vec<f32>,
        interpolation: Interpolation,
        kind: Kind,
    ) -> Result<(Self, Option<String>), String> {
        let per_key = kind.width() * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let (keys, held) = (times.len(), values.len().checked_div(per_key).unwrap_or(0));
        let odd = (held != keys || held * per_key != values.len())
            .then(|| format!("{} numbers for {keys} keys of {per_key}", values.len()));
        times.truncate(held);
        values.truncate(times.len() * per_key);
        if times.is_empty() {
            return Err(odd.unwrap_or_else(|| "it has no keys".into()));
        }
        if let Some(key) = times.iter().position(|time| !time.is_finite()) {
            return Err(format!("the time of key {key} is not finite"));
        }
        if let Some(key) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(format!("key {} at {} s is before key {key} at {} s", key + 1, times[key + 1], times[key]));
        }
        if let Some(place) = values.iter().position(|value| !value.is_finite()) {
            return Err(format!("a value of key {} is not finite", place / per_key));
        }
        Ok((Self { times, values, interpolation, kind }, odd))
    }

    /// Times of the first and the last key, in seconds.
    pub fn span(&self) -> [f64; 2] {
        let ends = [self.times.first(), self.times.last()];
        ends.map(|time| time.copied().map_or(0.0, f64::from))
    }

    /// Numbers of a value.
    pub fn width(&self) -> usize {
        self.kind.width()
    }

    /// The value at `time` seconds; before the first key and after the last one that of this key. Rotations are unit
    /// quaternions, or zero where the keys have none.
    pub fn at(&self, time: f64) -> Vec<f64> {
        // The first key after `time`.
        let next = self.times.partition_point(|key| f64::from(*key) <= time);
        let value = match (next, self.times.len()) {
            (0, _) => self.value(0),
            (next, count) if next == count => self.value(count - 1),
            (next, _) => self.between(next - 1, time),
        };
        if self.kind == Kind::Rotation { unit(value) } else { value }
    }

    fn between(&self, key: usize, time: f64) -> Vec<f64> {
        let [start, end] = [key, key + 1].map(|key| f64::from(self.times[key]));
        let (interval, t) = (end - start, (time - start) / (end - start));
        match (self.interpolation, self.kind) {
            (Interpolation::Step, _) => self.value(key),
            (Interpolation::Linear, Kind::Rotation) => slerp(&self.value(key), &self.value(key + 1), t),
            (Interpolation::Linear, Kind::Numbers(_)) => {
                let pairs = self.value(key).into_iter().zip(self.value(key + 1));
                pairs.map(|(a, b)| a * (1.0 - t) + b * t).collect()
            }
            (Interpolation::CubicSpline, _) => self.spline(key, t, interval),
        }
    }

    /// Equation of appendix C.5; the tangents are per second.
    fn spline(&self, key: usize, t: f64, interval: f64) -> Vec<f64> {
        let (t2, t3) = (t * t, t * t * t);
        let weights = [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2];
        let [from, out, to, into] =
            [(key, 1), (key, 2), (key + 1, 1), (key + 1, 0)].map(|(k, part)| self.part(k, part));
        let one = |i: usize| {
            let [a, b, c, d] = [from[i], interval * out[i], to[i], interval * into[i]];
            weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d
        };
        (0..self.width()).map(one).collect()
    }

    fn value(&self, key: usize) -> Vec<f64> {
        self.part(key, if self.interpolation == Interpolation::CubicSpline { 1 } else { 0 })
    }

    /// The numbers of a key; of a spline its in-tangent, value or out-tangent.
    fn part(&self, key: usize, part: usize) -> Vec<f64> {
        let (width, parts) = (self.width(), if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 });
        let start = (key * parts + part) * width;
        self.values[start..start + width].iter().copied().map(f64::from).collect()
    }
}

/// A quaternion of length 1, or zero where it has no direction.
fn unit(q: Vec<f64>) -> Vec<f64> {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    let scale = if length > 0.0 && length.is_finite() { length.recip() } else { 0.0 };
    q.into_iter().map(|x| x * scale).collect()
}

/// Spherical interpolation by the shorter arc (appendix C.4).
fn slerp(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    let quaternion = |q: &[f64]| DQuat::from_slice(&unit(q.to_vec()));
    let (a, b) = (quaternion(a), quaternion(b));
    let dot = a.dot(b);
    let (b, dot) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    let angle = dot.min(1.0).acos();
    // The limit of the formula where the sine vanishes.
    let [u, v] = match angle.sin() {
        sin if sin > 1e-9 => [((1.0 - t) * angle).sin() / sin, (t * angle).sin() / sin],
        _ => [1.0 - t, t],
    };
    (a * u + b * v).to_array().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampler(times: &[f32], values: &[f32], interpolation: Interpolation, kind: Kind) -> Sampler {
        let (sampler, odd) = Sampler::new(times.to_vec(), values.to_vec(), interpolation, kind).expect("good keys");
        assert_eq!(odd, None);
        sampler
    }

    #[track_caller]
    fn close(value: &[f64], expected: &[f64]) {
        let error = value.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(value.len() == expected.len() && error < 1e-6, "{value:?}, not {expected:?}");
    }

    #[test]
    fn steps_hold_and_lines_connect() {
        let numbers = Kind::Numbers(2);
        let step = sampler(&[1.0, 2.0, 4.0], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], Interpolation::Step, numbers);
        close(&step.at(1.999), &[0.0, 1.0]);
        close(&step.at(2.0), &[2.0, 3.0]);
        close(&step.at(3.999), &[2.0, 3.0]);
        close(&step.at(4.0), &[4.0, 5.0]);
        let linear = sampler(&[1.0, 2.0, 4.0], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], Interpolation::Linear, numbers);
        close(&linear.at(1.25), &[0.5, 1.5]);
        close(&linear.at(3.0), &[3.0, 4.0]);
        for (time, value) in [(-1e9, [0.0, 1.0]), (0.0, [0.0, 1.0]), (4.0, [4.0, 5.0]), (1e9, [4.0, 5.0])] {
            close(&linear.at(time), &value);
            close(&step.at(time), &value);
        }
        assert_eq!(linear.span(), [1.0, 4.0]);
    }

    #[test]
    fn one_key_is_a_value_and_equal_times_are_a_jump() {
        for interpolation in [Interpolation::Step, Interpolation::Linear] {
            let one = sampler(&[3.0], &[7.0], interpolation, Kind::Numbers(1));
            [-1.0, 3.0, 9.0].into_iter().for_each(|time| close(&one.at(time), &[7.0]));
        }
        let spline = sampler(&[3.0], &[9.0, 7.0, 9.0], Interpolation::CubicSpline, Kind::Numbers(1));
        [-1.0, 3.0, 9.0].into_iter().for_each(|time| close(&spline.at(time), &[7.0]));
        let jump = sampler(&[0.0, 1.0, 1.0, 2.0], &[0.0, 1.0, 5.0, 6.0], Interpolation::Linear, Kind::Numbers(1));
        close(&jump.at(0.999_999_999), &[1.0]);
        close(&jump.at(1.0), &[5.0]);
    }

    /// About z: 10 degrees and 350 degrees are 20 degrees apart, whatever the signs of the quaternions.
    #[test]
    fn rotations_take_the_shorter_way() {
        let about_z = |degrees: f64| {
            let half = 0.5 * degrees.to_radians();
            [0.0, 0.0, half.sin(), half.cos()]
        };
        for sign in [1.0, -1.0] {
            let keys: Vec<f32> =
                about_z(10.0).into_iter().chain(about_z(350.0).map(|x| sign * x)).map(|x| x as f32).collect();
            let turn = sampler(&[0.0, 1.0], &keys, Interpolation::Linear, Kind::Rotation);
            let angle = |time| {
                let q = turn.at(time);
                (2.0 * q[2].atan2(q[3])).to_degrees().rem_euclid(360.0)
            };
            assert!((angle(0.25) - 5.0).abs() < 1e-4, "{}", angle(0.25));
            assert!((angle(0.75) - 355.0).abs() < 1e-4, "{}", angle(0.75));
        }
        // Equal keys, keys that are not unit, and keys that are none.
        let same =
            sampler(&[0.0, 1.0], &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 5.0], Interpolation::Linear, Kind::Rotation);
        close(&same.at(0.3), &[0.0, 0.0, 0.0, 1.0]);
        let none = sampler(&[0.0, 1.0], &[0.0; 8], Interpolation::Linear, Kind::Rotation);
        close(&none.at(0.3), &[0.0; 4]);
    }

    /// A spline through a cubic polynomial with its derivatives is this polynomial, whatever the interval.
    #[test]
    fn splines_reproduce_cubics() {
        let p = |t: f64| 2.0 - t + 0.5 * t * t + 0.25 * t * t * t;
        let d = |t: f64| -1.0 + t + 0.75 * t * t;
        let times = [0.5, 1.0, 3.0];
        let values: Vec<f32> = times.iter().flat_map(|t| [d(*t), p(*t), d(*t)]).map(|x| x as f32).collect();
        let times = times.map(|t| t as f32);
        let spline = sampler(&times, &values, Interpolation::CubicSpline, Kind::Numbers(1));
        for time in [0.5, 0.7, 1.0, 1.7, 2.9] {
            close(&spline.at(time), &[p(time)]);
        }
        close(&spline.at(99.0), &[p(3.0)]);
        // Tangents that are not scaled by the interval give another curve.
        let t: f64 = 0.35;
        let unscaled = spline.spline(1, t, 1.0)[0];
        assert!((unscaled - p(1.7)).abs() > 0.1, "{unscaled}");
        let turn = sampler(
            &[0.0, 1.0],
            &[[0.0; 4], [0.0, 0.0, 0.0, 1.0], [0.0; 4], [0.0; 4], [0.0, 0.0, 1.0, 0.0], [0.0; 4]].concat(),
            Interpolation::CubicSpline,
            Kind::Rotation,
        );
        let half = 0.5f64.sqrt();
        close(&turn.at(0.5), &[0.0, 0.0, half, half]);
    }

    #[test]
    fn damaged_keys_are_refused_or_read_around() {
        let refusal = |times: &[f32], values: &[f32]| {
            Sampler::new(times.to_vec(), values.to_vec(), Interpolation::Linear, Kind::Numbers(1)).expect_err("damaged")
        };
        assert_eq!(refusal(&[0.0, f32::NAN], &[0.0, 1.0]), "the time of key 1 is not finite");
        assert_eq!(refusal(&[0.0, 2.0, 1.0], &[0.0, 1.0, 2.0]), "key 2 at 1 s is before key 1 at 2 s");
        assert_eq!(refusal(&[0.0, 1.0], &[0.0, f32::INFINITY]), "a value of key 1 is not finite");
        assert_eq!(refusal(&[0.0], &[]), "0 numbers for 1 keys of 1");
        assert_eq!(refusal(&[], &[]), "it has no keys");
        let odd = |times: usize, values: usize| {
            let times = (0..times).map(|i| i as f32).collect();
            Sampler::new(times, vec![1.0; values], Interpolation::CubicSpline, Kind::Numbers(2)).expect("usable")
        };
        assert_eq!(odd(3, 18).1, None);
        let (short, text) = odd(3, 13);
        assert_eq!((short.span(), text.as_deref()), ([0.0, 1.0], Some("13 numbers for 3 keys of 6")));
        assert_eq!(odd(1, 18).1.as_deref(), Some("18 numbers for 1 keys of 6"));
        let nothing = Sampler::new(vec![0.0], vec![], Interpolation::Linear, Kind::Numbers(0));
        assert!(nothing.is_err(), "values without numbers");
    }
}
