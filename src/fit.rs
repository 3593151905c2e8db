//! Power laws through measured points: a straight line is fitted to the logarithms.

/// `y` grows like `x^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Slope of ln y over ln x, by least squares.
    pub exponent: f64,
    /// Standard error of the exponent; `None` for two points, through which a line always goes.
    pub error: Option<f64>,
    /// Slope between the two points with the greatest x. Constant costs have the least share there.
    pub last: f64,
    /// Points that were fitted.
    pub points: usize,
}

/// The power law nearest to points (x, y). `None` with fewer than two different x; points that have no logarithm are
/// left out.
pub fn fit(points: &[(f64, f64)]) -> Option<Fit> {
    let usable = |v: f64| v > 0.0 && v.is_finite();
    let mut logs: Vec<(f64, f64)> =
        points.iter().filter(|(x, y)| usable(*x) && usable(*y)).map(|(x, y)| (x.ln(), y.ln())).collect();
    logs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let sxx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let (&greatest, rest) = logs.split_last()?;
    let before = rest.iter().rev().find(|(x, _)| *x < greatest.0)?;
    let exponent = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / sxx;
    let residual: f64 = logs.iter().map(|(x, y)| (y - my - exponent * (x - mx)).powi(2)).sum();
    let error = (logs.len() > 2).then(|| (residual / (n - 2.0) / sxx).sqrt());
    let last = (greatest.1 - before.1) / (greatest.0 - before.0);
    Some(Fit { exponent, error, last, points: logs.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_exactly() {
        let points: Vec<(f64, f64)> = [1e7, 1e4, 1e5, 1e6].iter().map(|&x: &f64| (x, 3.0 * x.powf(0.75))).collect();
        let found = fit(&points).expect("four points");
        assert!((found.exponent - 0.75).abs() < 1e-12 && (found.last - 0.75).abs() < 1e-12, "{found:?}");
        assert!(found.error.expect("more than two points") < 1e-12);
        assert_eq!(found.points, 4);
    }

    /// Logarithms 0, 1, 2 against 0, 1, 3: slope 3/2, residuals 1/6, -1/3, 1/6, standard error sqrt(1/6 / 1 / 2).
    #[test]
    fn the_error_is_that_of_the_slope() {
        let points = [(0.0f64, 0.0f64), (1.0, 1.0), (2.0, 3.0)].map(|(x, y)| (x.exp(), y.exp()));
        let found = fit(&points).expect("three points");
        assert!((found.exponent - 1.5).abs() < 1e-12, "{found:?}");
        assert!((found.error.expect("three points") - (1.0f64 / 12.0).sqrt()).abs() < 1e-12, "{found:?}");
        assert!((found.last - 2.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn too_little_to_fit() {
        assert_eq!(fit(&[]), None);
        assert_eq!(fit(&[(1.0, 2.0)]), None);
        assert_eq!(fit(&[(1.0, 2.0), (1.0, 3.0)]), None);
        assert_eq!(fit(&[(1.0, 2.0), (2.0, 0.0)]), None, "no logarithm");
        let two = fit(&[(1.0, 2.0), (2.0, 8.0)]).expect("two points");
        assert!((two.exponent - 2.0).abs() < 1e-12);
        assert_eq!(two.error, None);
    }
}
