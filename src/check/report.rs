//! Outcomes of cases as text: a table for people, the same as Markdown, as JSON, and plots of error over a parameter.

use serde_json::{Value, json};

use super::{Finding, Outcome, Verdict, Within};
use crate::plot::{Axis, Plot, Series};

/// A number in few letters.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() || (value.fract() == 0.0 && size < 1e7) {
        format!("{value}")
    } else if (1e-3..1e5).contains(&size) {
        let digits = (5 - size.log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{value:.digits$}");
        let whole = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        whole.to_owned()
    } else {
        format!("{value:.4e}")
    }
}

/// What is allowed, in words.
fn allowed(finding: &Finding) -> String {
    let percent = |part: f64| format!("{} %", number(part * 100.0));
    match finding.within {
        Within::Part(part) if part >= 1e-4 => percent((part * 1e9).round() / 1e9),
        Within::Part(part) => format!("{part:.0e} of it"),
        Within::Range(range) => format!("± {}", number(range)),
        Within::Exact => "exact".into(),
        Within::AtMost => "at most".into(),
        Within::AtLeast => "at least".into(),
    }
}

/// What was found, expected and allowed, and the verdict.
fn cells(finding: &Finding) -> [String; 5] {
    let verdict = Verdict::of(finding).word().to_owned();
    [finding.what.clone(), number(finding.expected), number(finding.found), allowed(finding), verdict]
}

/// The table of a case as lines of text.
pub fn text(outcome: &Outcome) -> String {
    let case = outcome.case;
    let verdict = outcome.verdict().word();
    let mut lines = vec![format!("{:>3}  {}: {verdict}, {:.1} s", case.number, case.title, outcome.seconds)];
    for finding in &outcome.findings {
        let [what, expected, found, allowed, verdict] = cells(finding);
        lines.push(format!("     {what:<66} {expected:>12} {found:>12} {allowed:>12}  {verdict}"));
    }
    lines.extend(outcome.error.as_ref().map(|error| format!("     ended by an error: {error}")));
    lines.join("\n")
}

/// A case as JSON.
pub fn json(outcome: &Outcome) -> Value {
    let finding = |f: &Finding| {
        let within = match f.within {
            Within::Part(_) => "part",
            Within::Range(_) => "range",
            Within::Exact => "exact",
            Within::AtMost => "at_most",
            Within::AtLeast => "at_least",
        };
        json!({
            "what": f.what, "parameter": f.parameter, "expected": f.expected, "found": f.found, "off": f.off(),
            "within": within, "tolerance": f.tolerance(), "not": f.rival, "known_gap": f.gap,
            "verdict": Verdict::of(f).word(),
        })
    };
    json!({
        "case": outcome.case.number, "title": outcome.case.title, "reason": outcome.case.reason,
        "verdict": outcome.verdict().word(), "seconds": outcome.seconds,
        "error": outcome.error.as_ref().map(ToString::to_string),
        "findings": outcome.findings.iter().map(finding).collect::<Vec<_>>(),
    })
}

/// The file of a case's plot, without its folder.
pub fn figure_name(outcome: &Outcome) -> String {
    format!("case-{:02}.svg", outcome.case.number)
}

/// Error against the parameter of a case as SVG; `None` where a case has none, or too few points.
pub fn figure(outcome: &Outcome) -> Option<String> {
    let name = outcome.case.parameter?;
    let with: Vec<(f64, &Finding)> = outcome.findings.iter().filter_map(|f| Some((f.parameter?, f))).collect();
    let mut places: Vec<f64> = with.iter().map(|(x, _)| *x).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let (first, last) = (*places.first()?, *places.last()?);
    if places.len() < 2 {
        return None;
    }
    let axis = if first > 0.0 && last > 20.0 * first { Axis::logarithmic(name) } else { Axis::linear(name) };
    // What was exact is shown at the rounding of single floats.
    const EXACT: f64 = 6e-8;
    let measured = |f: &&(f64, &Finding)| matches!(f.1.within, Within::Part(_) | Within::Range(_) | Within::Exact);
    let mut points: Vec<(f64, f64)> = with.iter().filter(measured).map(|(x, f)| (*x, f.off().max(EXACT))).collect();
    let mut limits: Vec<(f64, f64)> =
        with.iter().filter(measured).map(|(x, f)| (*x, f.tolerance().max(EXACT))).collect();
    for list in [&mut points, &mut limits] {
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let mut allowed = Series::new("allowed", limits);
    allowed.dashed = true;
    let plot = Plot {
        title: format!("{}: {}", outcome.case.number, outcome.case.title),
        x: axis,
        y: Axis::logarithmic("error"),
        series: vec![Series::new("found", points), allowed],
    };
    Some(plot.svg())
}

/// A cell of a Markdown table.
fn escaped(text: &str) -> String {
    text.replace('|', "\\|")
}

/// The outcomes as a page of Markdown; `machine` says where they were found, `folder` where the plots lie.
pub fn markdown(outcomes: &[Outcome], machine: &str, folder: &str) -> String {
    let count = |verdict: Verdict| outcomes.iter().filter(|outcome| outcome.verdict() == verdict).count();
    let seconds: f64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    let mut page = vec![
        "# Stiff and extreme cases".into(),
        String::new(),
        "`nephroid check` runs these cases on a device, and made this page. Every expected value is an analytic one, \
         a sum in double precision, or another way to the same picture; *reason* says which, and where the tolerance \
         comes from. A *known gap* is a limit of the renderer: the number is shown as it is, and the tolerance stays \
         what it should be."
            .into(),
        String::new(),
        format!(
            "{machine}: {} cases in {seconds:.0} s, {} passed, {} with known gaps, {} failed.",
            outcomes.len(),
            count(Verdict::Passed),
            count(Verdict::Gap),
            count(Verdict::Failed)
        ),
        String::new(),
        "| case | what | worst of its numbers | verdict |".into(),
        "|---|---|---|---|".into(),
    ];
    page.extend(outcomes.iter().map(summary));
    for outcome in outcomes {
        page.extend(section(outcome, folder));
    }
    page.join("\n") + "\n"
}

/// A case in one line: the number that is nearest to its limit.
fn summary(outcome: &Outcome) -> String {
    let case = outcome.case;
    let used = |f: &Finding| match f.tolerance() {
        0.0 => f64::from(u8::from(!f.holds())) * 1e9,
        tolerance => f.off() / tolerance,
    };
    let worst = outcome.findings.iter().max_by(|a, b| used(a).total_cmp(&used(b)));
    let worst = worst.map_or("none".to_owned(), |f| {
        let [what, expected, found, allowed, _] = cells(f);
        format!("{what}: {found} for {expected} ({allowed})")
    });
    let verdict = outcome.verdict().word();
    format!("| [{}](#case-{}) | {} | {} | {verdict} |", case.number, case.number, case.title, escaped(&worst))
}

/// The numbers of a case.
fn section(outcome: &Outcome, folder: &str) -> Vec<String> {
    let case = outcome.case;
    let mut lines = vec![String::new(), format!("## Case {}", case.number), String::new()];
    lines.push(format!("{}. *Reason:* {}. {:.1} s.", capital(case.title), case.reason, outcome.seconds));
    lines.push(String::new());
    if figure(outcome).is_some() {
        lines.extend([format!("![error]({folder}/{})", figure_name(outcome)), String::new()]);
    }
    lines.extend(["| what | expected | found | allowed | verdict |".into(), "|---|---|---|---|---|".into()]);
    for finding in &outcome.findings {
        lines.push(format!("| {} |", cells(finding).map(|cell| escaped(&cell)).join(" | ")));
    }
    let mut gaps: Vec<&str> =
        outcome.findings.iter().filter(|f| Verdict::of(f) == Verdict::Gap).filter_map(|f| f.gap).collect();
    gaps.dedup();
    lines.extend(gaps.iter().flat_map(|gap| [String::new(), format!("*Known gap:* {gap}.")]));
    lines.extend(outcome.error.iter().flat_map(|error| [String::new(), format!("*Ended by an error:* {error}")]));
    lines
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::cases;
    use crate::plot::well_formed::check;

    fn outcome() -> Outcome {
        let case = cases().into_iter().find(|case| case.parameter.is_some()).expect("one with a parameter");
        let at = |x: f64, found: f64| {
            let mut finding = Finding::new(format!("at {x} | y"), found, 1.0, Within::Part(0.01));
            finding.at(x);
            finding
        };
        let mut gap = at(1000.0, 2.0);
        gap.gap("a reason");
        Outcome { case, findings: vec![at(1.0, 1.001), at(10.0, 1.0), gap], error: None, seconds: 1.0, plans: vec![] }
    }

    #[test]
    fn numbers_are_short() {
        let texts = [0.0, 1.0, 0.12345678, 12_345.678, 1e-9, 3e20, f64::NAN, -0.5].map(number);
        assert_eq!(texts, ["0", "1", "0.123457", "12345.7", "1.0000e-9", "3.0000e20", "NaN", "-0.5"]);
    }

    #[test]
    fn a_page_has_all_numbers_and_a_plot() {
        let outcome = outcome();
        assert_eq!(check(&figure(&outcome).expect("three points")), Ok(()));
        let page = markdown(&[outcome], "a machine", "folder");
        assert!(page.contains("0 passed, 1 with known gaps, 0 failed"), "{page}");
        assert!(
            page.contains("at 10 \\| y | 1 | 1 | 1 % | pass |") && page.contains("*Known gap:* a reason."),
            "{page}"
        );
    }
}
