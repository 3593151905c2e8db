//! Which setting is the best compromise over many scenes, and what it costs on each.

use super::statistics::ratio;

/// What one variant loses.
#[derive(Debug, Clone, PartialEq)]
pub struct RegretRow {
    /// Name of the variant.
    pub variant: String,
    /// Its error over the least error of any variant, by scene; `None` where it was not measured, or nothing there was
    /// finite.
    pub losses: Vec<Option<f64>>,
    /// Geometric mean of the losses; `None` if one of a scene that counts is missing.
    pub mean: Option<f64>,
    /// Greatest loss, as `mean`.
    pub worst: Option<f64>,
}

/// Losses of all variants on all scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct Regret {
    /// The scenes, as the losses are ordered.
    pub scenes: Vec<String>,
    /// A row per variant.
    pub rows: Vec<RegretRow>,
    /// The row with the smallest finite geometric mean (with equal ones the smallest worst loss, then the first).
    pub best: Option<usize>,
}

impl Regret {
    /// Losses from `error(variant, scene)`. A scene counts if one variant has a finite error there; to be chosen a
    /// variant must have been measured on every scene that counts.
    pub fn new(variants: &[String], scenes: &[String], error: impl Fn(&str, &str) -> Option<f64>) -> Self {
        let mut rows: Vec<RegretRow> = variants
            .iter()
            .map(|variant| RegretRow { variant: variant.clone(), losses: Vec::new(), mean: None, worst: None })
            .collect();
        let mut counted = vec![false; scenes.len()];
        for (scene, counts) in scenes.iter().zip(&mut counted) {
            let errors: Vec<Option<f64>> = variants.iter().map(|variant| error(variant, scene)).collect();
            let best = errors.iter().flatten().copied().filter(|e| e.is_finite()).min_by(f64::total_cmp);
            *counts = best.is_some();
            for (row, error) in rows.iter_mut().zip(errors) {
                row.losses.push(best.zip(error).and_then(|(best, error)| ratio(error, best)));
            }
        }
        for row in &mut rows {
            row.summarise(&counted);
        }
        // Means that differ by rounding only are equal.
        let rounded = |mean: f64| (mean.ln() * 1e9).round();
        let key = |row: &RegretRow| Some((rounded(row.mean.filter(|mean| mean.is_finite())?), row.worst?));
        let best = rows
            .iter()
            .enumerate()
            .filter_map(|(index, row)| Some((index, key(row)?)))
            .min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)))
            .map(|(index, _)| index);
        Self { scenes: scenes.to_vec(), rows, best }
    }

    /// Name of the best compromise.
    pub fn chosen(&self) -> Option<&str> {
        self.best.map(|index| self.rows[index].variant.as_str())
    }
}

impl RegretRow {
    fn summarise(&mut self, counted: &[bool]) {
        let losses = self.losses.iter().zip(counted).filter(|(_, counts)| **counts).map(|(loss, _)| *loss);
        let Some(losses) = losses.collect::<Option<Vec<f64>>>().filter(|losses| !losses.is_empty()) else { return };
        self.mean = Some((losses.iter().map(|loss| loss.ln()).sum::<f64>() / losses.len() as f64).exp());
        self.worst = losses.into_iter().max_by(f64::total_cmp);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regret<const S: usize>(table: &[[Option<f64>; S]]) -> Regret {
        let names = |count: usize| (0..count).map(|i| i.to_string()).collect::<Vec<_>>();
        let at = |variant: &str, scene: &str| {
            table[variant.parse::<usize>().expect("a row")][scene.parse::<usize>().expect("a column")]
        };
        Regret::new(&names(table.len()), &names(S), at)
    }

    /// Losses (1, 4, 1) with mean 4^(1/3), (2, 1, 2) with the same mean, and (1.5, 2, 1.2).
    #[test]
    fn the_best_compromise_need_not_win_anywhere() {
        let table = [[1.0, 8.0, 10.0], [4.0, 2.0, 40.0], [1.5, 3.0, 12.0]].map(|row| row.map(Some));
        let found = regret(&table);
        assert_eq!(found.rows[0].losses, [Some(1.0), Some(4.0), Some(1.0)]);
        assert!((found.rows[0].mean.expect("complete") - 4f64.powf(1.0 / 3.0)).abs() < 1e-12);
        assert_eq!(found.rows[1].worst, Some(4.0));
        assert!((found.rows[2].mean.expect("complete") - (1.5 * 1.5 * 1.2f64).powf(1.0 / 3.0)).abs() < 1e-12);
        assert_eq!(found.chosen(), Some("2"));
    }

    #[test]
    fn equal_means_are_told_apart_by_the_worst_scene() {
        let found = regret(&[[Some(1.0), Some(4.0)], [Some(4.0), Some(1.0)], [Some(2.0), Some(2.0)]]);
        assert_eq!(found.rows.iter().map(|r| r.worst).collect::<Vec<_>>(), [Some(4.0), Some(4.0), Some(2.0)]);
        assert_eq!(found.chosen(), Some("2"), "{found:?}");
    }

    #[test]
    fn what_was_not_measured_everywhere_is_not_chosen() {
        let found = regret(&[[Some(1.0), None], [Some(9.0), Some(9.0)]]);
        assert_eq!((found.rows[0].mean, found.rows[0].losses[0]), (None, Some(1.0)));
        assert_eq!(found.chosen(), Some("1"));
    }

    #[test]
    fn a_scene_without_anything_finite_does_not_count() {
        let found = regret(&[[Some(1.0), Some(f64::INFINITY)], [Some(2.0), None]]);
        assert_eq!((found.rows[0].mean, found.rows[1].mean), (Some(1.0), Some(2.0)));
        assert_eq!(found.rows[0].losses[1], None);
        assert_eq!(found.chosen(), Some("0"));
    }

    #[test]
    fn zeros_and_infinities() {
        let found = regret(&[[Some(0.0), Some(1.0)], [Some(0.1), Some(1.0)], [Some(0.0), Some(f64::INFINITY)]]);
        let means: Vec<_> = found.rows.iter().map(|r| r.mean).collect();
        assert_eq!(means, [Some(1.0), Some(f64::INFINITY), Some(f64::INFINITY)]);
        assert_eq!(found.chosen(), Some("0"));
        assert_eq!(
            regret(&[[Some(0.0), Some(2.0)], [Some(1.0), Some(1.0)]]).rows[0]
                .mean
                .map(|m| (m - 2f64.sqrt()).abs() < 1e-12),
            Some(true)
        );
        assert_eq!(regret::<0>(&[]).best, None);
        assert_eq!(regret::<0>(&[[]]).chosen(), None, "no scene, no choice");
    }
}
