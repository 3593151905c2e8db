//! Films of two methods: whose turn a pass is, and what the picture takes from which.

use super::*;

const TURNS: Turns = Turns::always(Round { first: 2, second: 3 });

#[test]
fn every_pass_is_of_one_method() {
    let of = |index| TURNS.of(index);
    // An opening in order, then rounds that are spread.
    assert_eq!([0, 1, 2, 3, 4].map(of), [(false, 0), (false, 1), (true, 0), (true, 1), (true, 2)]);
    assert_eq!([5, 6, 7, 8, 9].map(of), [(true, 3), (false, 2), (true, 4), (false, 3), (true, 5)]);
    let rounds = |then, at_last| Turns { then: Some(then), at_last: Some(at_last), ..TURNS };
    let [photons, paths] = [Round { first: 1, second: 0 }, Round { first: 0, second: 1 }];
    for turns in [TURNS, rounds(photons, paths), rounds(paths, Round { first: 16, second: 1 })] {
        for range in [0..0, 0..5, 1..3, 7..60, 39..41, (1 << 32) - 7..1 << 32] {
            let mut expected = [PassSet::default(), PassSet::default()];
            for index in range.clone() {
                let (second, own) = turns.of(index);
                assert!(expected[usize::from(second)].insert(own), "pass {index} twice");
            }
            assert_eq!(turns.split(&PassSet::of(range.clone())), expected, "{range:?}");
        }
    }
    // Ranges apart from each other stay apart or grow together, whichever their passes do.
    let apart: PassSet = "0..2,5..7".parse().expect("a set");
    assert_eq!(TURNS.split(&apart).map(|passes| passes.to_string()), ["0..3", "3..4"]);
    assert_eq!(TURNS.split(&PassSet::of(1..6)).map(|passes| passes.to_string()), ["1..2", "0..4"]);
}

#[test]
fn turns_are_known_as_far_as_they_were_chosen() {
    let opening = Turns::new(TURNS.opening);
    let looked = Turns { work: [30, 10], then: Some(Round { first: 1, second: 1 }), ..opening };
    let whole = Turns { at_last: Some(Round { first: 0, second: 1 }), ..looked };
    assert_eq!([opening, looked, whole].map(Turns::known), [5, Turns::SECOND_LOOK, u64::MAX]);
    assert!(whole.of(u64::MAX - 1).0);
    for (one, other) in [(opening, looked), (looked, whole), (opening, whole), (whole, whole)] {
        assert_eq!((one.agreed(other), other.agreed(one)), (Some(other), Some(other)));
    }
    let otherwise = Turns { then: Some(Round { first: 1, second: 2 }), ..looked };
    assert_eq!((otherwise.agreed(whole), whole.agreed(otherwise)), (None, None));
    assert_eq!(Turns { work: [31, 10], ..looked }.agreed(whole), None);
    // The passes that tell the work of either method may be in two films.
    let [one, other] = [[30, 0], [0, 10]].map(|work| Turns { work, ..opening });
    assert_eq!(one.agreed(other), Some(Turns { work: [30, 10], ..opening }));
    assert_eq!(Turns::new(Round { first: 3, second: 2 }).agreed(whole), None);
    // What a film may say of itself.
    let passes = |text: &str| text.parse::<PassSet>().expect("a set");
    assert!(opening.fit(&passes("0..5")) && !opening.fit(&passes("5..6")) && looked.fit(&passes("5..24")));
    assert!(!looked.fit(&passes("24..25")) && whole.fit(&passes("7..1000")));
    for damaged in [
        Turns { then: Some(Round { first: 0, second: 0 }), ..looked },
        Turns { then: None, ..whole },
        Turns::new(Round { first: 0, second: 2 }),
        Turns::new(Round { first: u32::MAX, second: 2 }),
    ] {
        assert!(!damaged.fit(&passes("")), "{damaged:?}");
    }
}

/// A film of 40 x 30 pixels: the first method has noise of 0.02 about 1 plus a bias that grows from left to right,
/// the second noise of 0.2 about 1.
fn film(passes: u64, bias: f64) -> Film {
    let mut film = Film::new(40, 30, [3, 0], false).with_turns(Some(TURNS));
    film.passes = PassSet::of(0..passes);
    let mut random = Random(7);
    let mut mix = film.mix.take().expect("a second method");
    for index in 0..passes {
        let (second, _) = TURNS.of(index);
        let (target, noise) = if second { (&mut mix.sums, 0.2) } else { (&mut film.sums, 0.02) };
        for (pixel, sums) in target.iter_mut().enumerate() {
            let offset = if second { 0.0 } else { bias * (pixel % 40) as f64 / 39.0 };
            for k in 0..3 {
                let value = ((1.0 + offset + noise * f64::from(random.normal())) / 8.0) as f32;
                sums[k] = sums[k].plus(value);
                sums[3 + k] = sums[3 + k].plus(value * value);
            }
        }
    }
    film.mix = Some(mix);
    film
}

fn mean_square_error(film: &Film, columns: std::ops::Range<usize>) -> f64 {
    let picture = film.picture();
    let wanted = |(i, _): &(usize, &f32)| columns.contains(&(i / 3 % 40));
    let errors: Vec<f64> =
        picture.layers[0].data.iter().enumerate().filter(wanted).map(|(_, x)| f64::from(x - 1.0).powi(2)).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

#[test]
fn a_bias_that_the_second_method_shows_goes_and_the_rest_stays() {
    let passes = 500;
    let film = film(passes, 0.3);
    let (first, second) = (0.02f64.powi(2) / 200.0, 0.2f64.powi(2) / 300.0);
    // On the right the first method alone would be off by 0.3, on the left it has a sixtieth of the noise.
    let (left, right) = (mean_square_error(&film, 0..1), mean_square_error(&film, 36..40));
    println!("left {left:.2e} of {second:.2e}, right {right:.2e}");
    assert!((0.8 * second..1.2 * second).contains(&right), "{right} for {second}");
    let unbiased = mean_square_error(&super::tests::film(passes, 0.0), 0..40);
    println!("without bias {unbiased:.2e} of {first:.2e}");
    assert!(unbiased < 4.0 * first, "{unbiased} for {first} of the first method alone and {second} of the second");
    let weights = mixed(&film);
    assert!(weights[20 * 40 + 38].weight > 0.98 && weights.iter().all(|w| (0.0..=1.0).contains(&w.weight)));
    let bias = weights[20 * 40 + 38].squared_bias.sqrt();
    assert!((bias / 0.29 - 1.0).abs() < 0.1, "{bias}");
}

#[test]
fn few_passes_make_a_picture() {
    let all = |film: &Film, weight: f64| mixed(film).iter().all(|w| w.weight == weight);
    assert!((0..3).all(|passes| all(&film(passes, 0.3), 0.0)), "passes of the first");
    let only_second = Film { passes: PassSet::of(3..4), ..film(5, 0.3) };
    assert!(all(&only_second, 1.0), "one pass of the second");
    let mean = |film: &Film, columns: std::ops::Range<usize>| {
        let weights = mixed(film);
        let wanted = weights.iter().enumerate().filter(|(i, _)| columns.contains(&(i % 40)));
        wanted.map(|(_, w)| w.weight).sum::<f64>() / (30 * columns.len()) as f64
    };
    // A single pass of the second tells its noise by neighbours, and is not shown.
    let three = film(3, 0.9);
    assert!(all(&three, 0.0), "two passes of the first and one of the second");
    let told = compared(&three).expect("both");
    let variance = told.iter().map(|pixel| pixel.variances[1]).sum::<f64>() / told.len() as f64;
    assert!((variance / (3.0 * 0.2f64.powi(2)) - 1.0).abs() < 0.1, "{variance}");
    // Three of them do: where the first has no bias, it has less noise, and is taken.
    let five = film(5, 0.9);
    println!("{:.2} {:.2}", mean(&five, 0..5), mean(&five, 30..40));
    assert!(mean(&five, 0..5) < 0.3 && mean(&five, 30..40) > 0.6);
    assert!(mean_square_error(&five, 0..5) < 0.5 * 0.04 / 3.0, "half of the noise of the second");
    // A part of a render may have one pass of the first, and no more.
    assert!(best([f64::INFINITY, 0.01, 1.0, 1.0]).weight > 0.9);
    assert!(best([f64::INFINITY, 0.01, 0.01, 1.0]).weight < 0.1);
    assert_eq!(best([f64::INFINITY; 4]).weight, 0.5);
    assert_eq!(mixed(&Film::new(2, 2, [0; 2], false)), []);
}

/// The edge of a lamp, where the first method has much noise, does not make the wall beside it take the second.
#[test]
fn a_pixel_of_much_noise_speaks_for_itself() {
    let weights = |edge: f64| {
        let mut relative = vec![[1e-4, 1e-2, 1.2e-2, 1.0]; 40 * 30];
        relative[15 * 40 + 20] = [edge, edge, 2.0 * edge, 1.0];
        temper(&mut relative, 40);
        blurred(&relative, 40).into_iter().map(best).map(|at| at.weight).collect::<Vec<_>>()
    };
    let (even, with) = (weights(1e-4), weights(100.0));
    assert!(even[15 * 40 + 22] < 0.02 && with[15 * 40 + 22] < 0.05, "{}", with[15 * 40 + 22]);
    let mut untempered = vec![[1e-4, 1e-2, 1.2e-2, 1.0]; 40 * 30];
    untempered[15 * 40 + 20] = [100.0, 100.0, 200.0, 1.0];
    assert!(best(blurred(&untempered, 40)[15 * 40 + 22]).weight > 0.4, "it would");
    // What the second shows in one pixel of many is its noise, and stays.
    let mut rare = vec![[1e-4, 0.0, 1e-4, 1.0]; 40 * 30];
    rare[15 * 40 + 20] = [1e-4, 1.0, 1.0, 1.0];
    let before = rare.clone();
    temper(&mut rare, 40);
    assert_eq!(rare, before);
}

#[test]
fn what_the_second_method_has_not_found_stays() {
    // The first shows light everywhere, the second none, or in one pixel of a hundred: no bias of the first.
    let (first, few, many) = (0.01, 0.3, 4e-4);
    for (t, mean) in [(0.0, 0.0), (few, 0.1)] {
        let at = best([first, t, 1.0, mean]);
        assert!(at.weight < 0.02 && at.squared_bias == 0.0, "{at:?}");
    }
    // A second that has seen enough is believed.
    let at = best([first, many, 0.09, 0.7]);
    assert!(at.weight > 0.98 && at.squared_bias > 0.02, "{at:?}");
}

#[test]
fn parts_add_up() {
    let whole = film(20, 0.1);
    let mut sum = Film { passes: PassSet::of(0..0), ..Film::new(40, 30, [3, 0], false).with_turns(Some(TURNS)) };
    sum.merge(&whole).expect("the same turns");
    assert_eq!(sum, whole);
    let other = Film::new(40, 30, [3, 0], false).with_turns(Some(Turns::always(Round { first: 1, second: 3 })));
    assert!(sum.merge(&other).is_err() && sum.merge(&Film::new(40, 30, [3, 0], false)).is_err());
}
