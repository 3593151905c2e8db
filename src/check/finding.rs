//! What a case finds, and whether it is what it should be.

/// How far a number may be from what is expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Within {
    /// Off by this part of the expected value.
    Part(f64),
    /// Off by this much.
    Range(f64),
    /// The expected number itself.
    Exact,
    /// The expected number is the greatest allowed.
    AtMost,
    /// The expected number is the least allowed.
    AtLeast,
}

/// A number that a case measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What was measured.
    pub what: String,
    /// Value of the case's parameter, if it has one.
    pub parameter: Option<f64>,
    /// The number.
    pub found: f64,
    /// What it should be.
    pub expected: f64,
    /// How near it has to be.
    pub within: Within,
    /// What a likely mistake would give; that is to be told from what was found.
    pub rival: Option<f64>,
    /// A limit of the renderer that is known: why this is not as it should be.
    pub gap: Option<&'static str>,
}

impl Finding {
    /// A number without a parameter.
    pub fn new(what: impl Into<String>, found: f64, expected: f64, within: Within) -> Self {
        Self { what: what.into(), parameter: None, found, expected, within, rival: None, gap: None }
    }

    /// Belongs to this value of the case's parameter.
    pub fn at(&mut self, parameter: f64) -> &mut Self {
        self.parameter = Some(parameter);
        self
    }

    /// A likely mistake would give `rival`. Of no use for [`Within::AtMost`] and [`Within::AtLeast`], which have a
    /// side that everything passes on.
    pub fn not(&mut self, rival: f64) -> &mut Self {
        self.rival = Some(rival);
        self
    }

    /// Fails where this renderer has a limit.
    pub fn gap(&mut self, reason: &'static str) -> &mut Self {
        self.gap = Some(reason);
        self
    }

    /// The distance from `expected` in the measure of [`Self::within`].
    fn off_from(&self, expected: f64) -> f64 {
        match self.within {
            Within::Part(_) if expected != 0.0 => (self.found / expected - 1.0).abs(),
            Within::AtMost => (self.found - expected).max(0.0),
            Within::AtLeast => (expected - self.found).max(0.0),
            _ if self.found == expected => 0.0,
            _ => (self.found - expected).abs(),
        }
    }

    /// How far it is off: a part of the expected value for [`Within::Part`], a difference for all others.
    pub fn off(&self) -> f64 {
        self.off_from(self.expected)
    }

    /// The largest [`Self::off`] that is allowed.
    pub fn tolerance(&self) -> f64 {
        match self.within {
            Within::Part(part) => part,
            Within::Range(range) => range,
            Within::Exact | Within::AtMost | Within::AtLeast => 0.0,
        }
    }

    /// Whether it is as expected, and not as a mistake would have it. What is not a number is never.
    pub fn holds(&self) -> bool {
        let near = |expected: f64| self.off_from(expected) <= self.tolerance();
        near(self.expected) && !self.found.is_nan() && self.rival.is_none_or(|rival| !near(rival))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(found: f64, expected: f64, within: Within) -> bool {
        Finding::new("", found, expected, within).holds()
    }

    #[test]
    fn findings_can_fail() {
        assert!(holds(1.0049, 1.0, Within::Part(0.005)) && !holds(1.0051, 1.0, Within::Part(0.005)));
        assert!(holds(-2.0, -2.05, Within::Range(0.1)) && !holds(-2.0, -2.2, Within::Range(0.1)));
        assert!(holds(0.0, 0.0, Within::Exact) && !holds(1e-30, 0.0, Within::Exact));
        assert!(holds(0.5, 1.0, Within::AtMost) && !holds(1.5, 1.0, Within::AtMost));
        assert!(holds(1.5, 1.0, Within::AtLeast) && !holds(0.5, 1.0, Within::AtLeast));
        assert!(holds(0.0, 0.0, Within::Part(0.1)), "0 of 0");
        for within in [Within::Part(0.5), Within::Range(0.5), Within::Exact, Within::AtMost, Within::AtLeast] {
            assert!(!holds(f64::NAN, 1.0, within), "{within:?}");
        }
        assert!(!holds(f64::INFINITY, 1.0, Within::Part(0.5)) && !holds(f64::INFINITY, 1.0, Within::AtMost));
    }

    #[test]
    fn a_rival_has_to_be_told_apart() {
        let mut finding = Finding::new("", 1.0, 1.0, Within::Part(0.05));
        assert!(finding.not(1.1).holds());
        assert!(!finding.not(1.01).holds(), "the tolerance is too wide to tell");
    }
}
