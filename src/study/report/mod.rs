//! The report of a study: one HTML page that needs nothing else, its plots one by one, and a short summary in Markdown.

mod costs;
mod errors;
mod figures;
mod table;

use std::fmt::Write;

use super::curves::{budgets, scenes};
use super::results::Results;
use crate::plot::text::escape;
use figures::{Figure, Kind};

/// How the page looks; no `<` in it, so that the page is XML too.
const STYLE: &str = "
:root{color-scheme:light dark;--ink:#202020;--back:#f6f6f4;--line:#c8c8c8;--soft:#ebebe8}
@media (prefers-color-scheme:dark){:root{--ink:#e4e4e4;--back:#1b1f23;--line:#454c53;--soft:#262b30}}
body{margin:0 auto;padding:1.5rem;max-width:76rem;font:16px/1.5 sans-serif;color:var(--ink);background:var(--back)}
h1,h2,h3{line-height:1.2}h2{margin-top:3rem;border-bottom:2px solid var(--line)}
a{color:inherit}figure{margin:1rem 0;display:inline-block;max-width:100%}svg{max-width:100%;height:auto}
.wide{overflow-x:auto;margin:1rem 0}table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.875rem}
caption{text-align:left;font-weight:bold;padding:.3rem 0}
th,td{border-bottom:1px solid var(--line);padding:.2rem .7rem;text-align:right;vertical-align:top}
th[scope=row],thead th:first-child{text-align:left;font-weight:normal}thead th{background:var(--soft)}
.prose td,.prose thead th{text-align:left}strong{text-decoration:underline}dt{font-weight:bold}
";

/// How to read the page.
const HOW_TO_READ: [(&str, &str); 7] = [
    (
        "Error",
        "relMSE is the mean over the pixels of (x - r)\u{b2} / (r\u{b2} + 0.01) against a reference r. Trimmed: \
         without the worst 0.1 % of the pixels, so that a few fireflies do not decide. A quarter of it is half the \
         noise. A picture that is not a number counts as infinitely wrong.",
    ),
    (
        "Plots",
        "Both axes are logarithmic; lower and further left is better. A line joins the medians over the seeds, the \
         band around it holds the middle 80 % of them. Dashed lines with hollow marks are other renderers, one run \
         each.",
    ),
    (
        "Slopes",
        "The exponent with which the error falls: -1 is noise that averages out, -2/3 is progressive photon mapping \
         with a = 2/3, 0 is a floor of bias. Points of one render depend on each other, so each seed gives one slope, \
         and the 95 % interval is Student's over the seeds. With one seed, and for other renderers, it comes from the \
         residuals of the one curve and is too narrow.",
    ),
    (
        "Equal time",
        "Each seed's curve is read at the time, straight between its points; the median over the seeds stands in the \
         table. Nothing is extrapolated: a dash is out of range. A render ends with the first whole pass beyond its \
         budget; up to 10 % outside of the measured times the nearest point stands in, marked \u{2248}.",
    ),
    (
        "Equal error",
        "The first time at which the median curve comes down to the error. \u{2264}: at the first measured point \
         already, so that the least time is not known, and ratios to it are from below (\u{2265}). A dash: never.",
    ),
    (
        "Bias and variance",
        "Over seeds with the same passes: what their mean is off by, squared, and how they differ. Their sum is the \
         error of one render. Bias\u{b2} has the variance of the mean taken off and may come out a little negative \
         where there is none: such points have no place on the logarithmic plot. Intervals come from the residuals of \
         the line.",
    ),
    (
        "Regret",
        "What a variant loses on a scene is its error over the least error of any variant there. The best compromise \
         has the smallest geometric mean of its losses over all scenes. A variant that was not measured on all of them \
         is out of the choice. Where few seeds alone agree with the choice, the variants are too close to tell.",
    ),
];

/// The page: settings, regret, and for each scene plots and tables. Valid without any measurements; all names are
/// escaped; it holds no script and loads nothing.
pub fn html(results: &Results) -> String {
    let title = if results.title.trim().is_empty() { "Error against run time" } else { results.title.as_str() };
    let title = escape(title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    // Writing to a string cannot fail, here and below.
    let _ = writeln!(
        page,
        "<p>{}; nephroid {}; {} measured points, {} of other renderers, {} decompositions.</p>",
        escape(known(&results.device, "device not recorded")),
        escape(known(&results.version, "of unknown version")),
        results.measurements.len(),
        results.peers.len(),
        results.decompositions.len()
    );
    let names = scenes(results);
    if names.is_empty() {
        page.push_str("<p>Nothing has been measured yet.</p>\n");
    }
    page.push_str("<ul>\n");
    for (index, name) in names.iter().enumerate() {
        let _ = writeln!(page, "<li><a href=\"#scene-{index}\">{}</a></li>", escape(name));
    }
    page.push_str("<li><a href=\"#how-to-read\">How to read this</a></li>\n</ul>\n");
    choice(&mut page, results);
    for (index, (name, figures)) in names.iter().zip(figures::figures(results)).enumerate() {
        let _ = writeln!(page, "<h2 id=\"scene-{index}\">{}</h2>", escape(name));
        scene(&mut page, results, name, &figures);
    }
    page.push_str("<h2 id=\"how-to-read\">How to read this</h2>\n<dl>\n");
    for (term, text) in HOW_TO_READ {
        let _ = writeln!(page, "<dt>{term}</dt><dd>{}</dd>", escape(text));
    }
    page.push_str("</dl>\n</body>\n</html>\n");
    page
}

fn known<'a>(text: &'a str, otherwise: &'a str) -> &'a str {
    if text.trim().is_empty() { otherwise } else { text }
}

/// Settings and regret.
fn choice(page: &mut String, results: &Results) {
    let settings = costs::settings(results).html();
    if !settings.is_empty() {
        let _ = writeln!(page, "<h2>Variants</h2>\n<div class=\"prose\">{settings}</div>");
    }
    let budgets = budgets(results);
    if !budgets.is_empty() {
        page.push_str("<h2>The best compromise over all scenes</h2>\n");
    }
    for budget in budgets {
        page.push_str(&errors::regret_table(results, budget).html());
    }
}

fn scene(page: &mut String, results: &Results, name: &str, figures: &[Figure]) {
    let put = |page: &mut String, kind: Kind| {
        for figure in figures.iter().filter(|figure| figure.kind == kind) {
            let _ = writeln!(page, "<figure>{}</figure>", figure.svg);
        }
    };
    put(page, Kind::Error);
    page.push_str(&errors::equal_time(results, name).html());
    page.push_str(&errors::equal_error(results, name).html());
    page.push_str(&errors::slopes(results, name).html());
    page.push_str(&costs::estimated(results, name).html());
    put(page, Kind::Parts);
    page.push_str(&errors::decomposition(results, name).html());
    put(page, Kind::Time);
    page.push_str(&costs::time_split(results, name).html());
    page.push_str(&costs::effort(results, name).html());
    let _ = writeln!(page, "<div class=\"prose\">{}</div>", costs::omissions(results, name).html());
}

/// Every plot of the page with a name for its file (small letters, digits, dashes, `.svg`): for each scene error
/// against seconds and photons, time split, bias and variance, as far as there is something to draw.
pub fn plots(results: &Results) -> Vec<(String, String)> {
    figures::figures(results).into_iter().flatten().map(|figure| (figure.file, figure.svg)).collect()
}

/// Errors at equal time for each scene and regret for each budget, as Markdown tables.
pub fn markdown_summary(results: &Results) -> String {
    let mut text = String::new();
    for name in scenes(results) {
        let mut table = errors::equal_time(results, &name);
        table.caption = format!("{name}. {}", table.caption);
        text.push_str(&table.markdown());
    }
    for budget in budgets(results) {
        text.push_str(&errors::regret_table(results, budget).markdown());
    }
    text
}

#[cfg(test)]
mod tests;
