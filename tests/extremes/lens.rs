//! The thin lens against what optics says of it: what lies in the sharp plane is as the pinhole sees it, a small source
//! elsewhere becomes a disc of known size, and no light is lost on the way.

use nephroid::Error;
use nephroid::low_level::picture::post::defocus::Defocus;
use nephroid::low_level::picture::post::{Post, View};
use nephroid::low_level::render::{Lens, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Material, Scene};

use crate::support::device::runtime;
use crate::support::lab::{Shot, assert_close, assert_same, close, difference, parallel, settings};

const YFOV: f32 = 0.6;

/// A square emitter of `side`, turned by a third of a radian, that faces the camera at the origin from `distance`.
fn source(distance: f32, side: f32) -> Scene {
    let (sine, cosine) = (1.0f32 / 3.0).sin_cos();
    let (u, v) = ([side * cosine, side * sine, 0.0], [-side * sine, side * cosine, 0.0]);
    let corner = [-0.5 * (u[0] + v[0]), -0.5 * (u[1] + v[1]), -distance];
    let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], YFOV);
    Scene::from_parts(vec![(Mesh::quad(corner, u, v), Material::emitter([1.0; 3]))], vec![], camera)
}

fn with_lens(size: u32, lens: Option<Lens>) -> Settings {
    Settings { lens, ..settings(size, size, 0) }
}

/// Sum over the pixels, and variance of the picture along x and along y in pixels.
fn moments(shot: &Shot, size: usize) -> (f64, [f64; 2]) {
    let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
    for (index, value) in shot.red("").into_iter().enumerate() {
        sum += value;
        for (axis, at) in [index % size, index / size].into_iter().enumerate() {
            let at = at as f64 + 0.5;
            first[axis] += value * at;
            second[axis] += value * at * at;
        }
    }
    (sum, [0, 1].map(|axis| second[axis] / sum - (first[axis] / sum).powi(2)))
}

/// Pixels per scene unit at a distance.
fn scale(size: usize, distance: f64) -> f64 {
    size as f64 / (2.0 * distance * (0.5 * f64::from(YFOV)).tan())
}

/// Variance of a source's picture: the disc's is r^2 / 4, the square's s^2 / 12 whatever its turn, the pixel's 1 / 12;
/// those of independent parts add up.
fn expected_variance(size: usize, distance: f64, side: f64, lens: Lens) -> f64 {
    let (radius, focus) = (f64::from(lens.radius), f64::from(lens.focus));
    let disc = radius * (distance - focus).abs() / focus * scale(size, distance);
    let square = side * scale(size, distance);
    disc * disc / 4.0 + (square * square + 1.0) / 12.0
}

#[test]
fn a_source_out_of_focus_is_a_disc_of_the_size_that_optics_demands() {
    const SIZE: usize = 64;
    for (distance, side, focus, radius) in [(2.0, 0.15, 1.0, 0.1), (2.0, 0.15, 4.0, 0.25), (3.0, 0.2, 2.0, 0.3)] {
        let lens = Lens { radius, focus };
        let scene = source(distance, side);
        let blurred = Shot::take(&scene, &with_lens(SIZE as u32, Some(lens)), 0..1024);
        let (sum, variance) = moments(&blurred, SIZE);
        let pinhole = Shot::take(&scene, &with_lens(SIZE as u32, None), 0..1024);
        let (sharp_sum, sharp) = moments(&pinhole, SIZE);
        assert_close(sum, sharp_sum, 0.01, "the lens keeps the energy");
        let (distance, side) = (f64::from(distance), f64::from(side));
        let expected = expected_variance(SIZE, distance, side, lens);
        let pinhole = expected_variance(SIZE, distance, side, Lens { radius: 0.0, focus });
        for axis in 0..2 {
            assert_close(variance[axis], expected, 0.02, "variance through the lens");
            assert_close(sharp[axis], pinhole, 0.02, "variance through the pinhole");
            let wrong = expected_variance(SIZE, distance, side, Lens { radius: 1.1 * radius, focus });
            assert!(close(variance[axis], wrong, 0.02).is_err(), "a tenth more must be noticed");
        }
        // Nothing lies outside of the disc, the half diagonal of the source and that of a pixel.
        let disc = f64::from(radius) * (distance - f64::from(focus)).abs() / f64::from(focus);
        let reach = (disc + side * 0.71) * scale(SIZE, distance) + 0.71;
        for (index, value) in blurred.red("").into_iter().enumerate() {
            let [x, y] = [index % SIZE, index / SIZE].map(|at| at as f64 + 0.5 - SIZE as f64 / 2.0);
            assert!(value == 0.0 || x.hypot(y) <= reach * 1.001, "light at ({x}, {y}) beyond {reach}");
        }
    }
}

#[test]
fn the_sharp_plane_is_as_the_pinhole_sees_it() {
    let unequal = |focus: f32| {
        let scene = source(2.0, 0.7);
        let lens = Some(Lens { radius: 0.3, focus });
        let (a, b) = (
            Shot::take(&scene, &with_lens(48, lens), 0..8).red(""),
            Shot::take(&scene, &with_lens(48, None), 0..8).red(""),
        );
        a.iter().zip(&b).filter(|(a, b)| (**a - **b).abs() > 1e-6).count()
    };
    // A ray that grazes the edge may fall to either side of it by rounding.
    assert!(unequal(2.0) <= 3, "{} pixels differ in focus", unequal(2.0));
    assert!(unequal(1.6) > 100, "{} pixels differ out of focus", unequal(1.6));
}

/// The blur after the render spreads a source as far as the lens does, before the edges and depths that it has to
/// guess.
#[test]
fn the_screen_space_blur_has_the_size_of_the_lens() {
    const SIZE: usize = 96;
    let (distance, side, lens) = (2.0, 0.3, Lens { radius: 0.1, focus: 4.0 });
    let mut shot = Shot::take(&source(distance, side), &with_lens(SIZE as u32, None), 0..64);
    let half = (0.5 * YFOV).tan();
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];
    let view = View { axes, half: [half; 2], orthographic: false };
    let expected = expected_variance(SIZE, f64::from(distance), f64::from(side), lens);
    let off = |shot: &Shot| moments(shot, SIZE).1.map(|variance| variance / expected - 1.0);
    assert!(off(&shot).iter().all(|x| *x < -0.05), "without blur it is too small: {:?}", off(&shot));
    let (sum, _) = moments(&shot, SIZE);
    let post = Post { defocus: Some(Defocus { radius: lens.radius, focus: lens.focus }), ..Post::default() };
    post.apply(&mut shot.picture, &view).expect("the depth is there");
    assert!(off(&shot).iter().all(|x| x.abs() < 0.03), "{:?}", off(&shot));
    assert_close(moments(&shot, SIZE).0, sum, 0.05, "energy is nearly kept");
}

#[test]
fn each_pass_and_seed_has_its_own_points_of_the_lens() {
    let scene = source(2.0, 0.3);
    let lens = with_lens(24, Some(Lens { radius: 0.2, focus: 1.0 }));
    let take = |settings: &Settings, first: u64| Shot::take(&scene, settings, first..first + 1).bits();
    assert_same(&take(&lens, 0), &take(&lens, 0), "the same pass twice");
    assert!(difference(&take(&lens, 0), &take(&lens, 1)).is_some());
    assert!(difference(&take(&lens, 0), &take(&Settings { seed: 1, ..lens.clone() }, 0)).is_some());
}

#[test]
fn what_cannot_have_a_lens_is_refused() {
    let mut scene = source(2.0, 0.3);
    let refused = |scene: &Scene, radius: f32, focus: f32| {
        let settings = with_lens(8, Some(Lens { radius, focus }));
        match Session::new(runtime().device(), scene.clone(), settings) {
            Err(Error::Setting { cause, .. }) => cause,
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("a lens of radius {radius}, focus {focus} was taken"),
        }
    };
    for (radius, focus) in [(0.0, 1.0), (-1.0, 1.0), (0.1, 0.0), (0.1, f32::INFINITY), (f32::NAN, 1.0), (0.1, 1e-42)] {
        assert!(refused(&scene, radius, focus).contains("finite and positive"));
    }
    scene.cameras[0] = parallel([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0);
    assert!(refused(&scene, 0.1, 1.0).contains("orthographic"));
}
