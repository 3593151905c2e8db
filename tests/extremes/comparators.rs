//! The comparators of these tests can fail.

use nephroid::low_level::picture::image::{Channels, Picture};

use crate::support::lab::{close, difference, unfinished};

#[test]
fn comparators_fail_on_sabotaged_input() {
    assert!(close(1.0049, 1.0, 0.005).is_ok() && close(1.0051, 1.0, 0.005).is_err());
    assert!(close(f64::NAN, 1.0, 0.5).is_err(), "NaN is never close");
    let render = [1.0f32, 2.0, 0.0].map(f32::to_bits);
    let mut broken = render;
    broken[1] += 1; // one ulp
    assert_eq!((difference(&render, &render), difference(&broken, &render)), (None, Some(1)));
    let negative_zero = [1.0f32, 2.0, -0.0].map(f32::to_bits);
    assert_eq!(difference(&negative_zero, &render), Some(2));
    assert_eq!(difference(&render[..2], &render), Some(2), "a missing number is a difference");
    let mut picture = Picture::new(1, 1);
    picture.push("depth", Channels::Scalar, vec![f32::INFINITY]);
    assert_eq!(unfinished(&picture), None);
    picture.push("", Channels::Rgb, vec![0.0, f32::NAN, 0.0]);
    assert_eq!(unfinished(&picture), Some((String::new(), 1)));
}
