//! A table that becomes HTML or Markdown, and numbers in it.

use std::fmt::Write;

use crate::plot::text::escape;

/// One cell.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Td {
    /// Plain text.
    pub text: String,
    /// Set in bold: the best, or the chosen.
    pub strong: bool,
}

impl<T: Into<String>> From<T> for Td {
    fn from(text: T) -> Self {
        Self { text: text.into(), strong: false }
    }
}

/// A table; the first column names the rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Table {
    /// What it shows.
    pub caption: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<Td>>,
}

impl Table {
    /// A table without rows.
    pub fn new<T: Into<String>>(caption: impl Into<String>, head: impl IntoIterator<Item = T>) -> Self {
        Self { caption: caption.into(), head: head.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// An element; nothing without rows.
    pub fn html(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let mut html =
            format!("<div class=\"wide\"><table>\n<caption>{}</caption>\n<thead><tr>", escape(&self.caption));
        for name in &self.head {
            // Writing to a string cannot fail, here and below.
            let _ = write!(html, "<th scope=\"col\">{}</th>", escape(name));
        }
        html.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            html.push_str("<tr>");
            for (column, cell) in row.iter().enumerate() {
                let text = escape(&cell.text);
                let text = if cell.strong { format!("<strong>{text}</strong>") } else { text };
                let _ = match column {
                    0 => write!(html, "<th scope=\"row\">{text}</th>"),
                    _ => write!(html, "<td>{text}</td>"),
                };
            }
            html.push_str("</tr>\n");
        }
        html.push_str("</tbody>\n</table></div>\n");
        html
    }

    /// The caption and the table; nothing without rows.
    pub fn markdown(&self) -> String {
        if self.rows.is_empty() {
            return String::new();
        }
        let mut text = format!("{}\n\n|", markdown(&self.caption));
        for name in &self.head {
            let _ = write!(text, " {} |", markdown(name));
        }
        text.push_str("\n|");
        for column in 0..self.head.len() {
            text.push_str(if column == 0 { "---|" } else { "---:|" });
        }
        for row in &self.rows {
            text.push_str("\n|");
            for cell in row {
                let inner = markdown(&cell.text);
                let _ = if cell.strong { write!(text, " **{inner}** |") } else { write!(text, " {inner} |") };
            }
        }
        text.push_str("\n\n");
        text
    }
}

/// Text that Markdown shows as it is, in one line.
pub(super) fn markdown(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => plain.push_str("&amp;"),
            '<' => plain.push_str("&lt;"),
            '>' => plain.push_str("&gt;"),
            '\\' | '|' | '*' | '_' | '`' | '[' | ']' | '#' | '~' | '$' => plain.extend(['\\', c]),
            c if c.is_control() => plain.push(' '),
            c => plain.push(c),
        }
    }
    plain
}

/// A number with three digits; what is none is a dash.
pub(super) fn figures(value: f64) -> String {
    if value.is_nan() {
        return "-".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "\u{221e}".into() } else { "-\u{221e}".into() };
    }
    let rounded = format!("{value:.2e}");
    // The size of what will stand there: 9.999 is written as 10.0.
    let size = rounded.parse::<f64>().unwrap_or(value).abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&size) {
        let digits = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}")
    } else {
        rounded
    }
}

/// The same of a number that may be missing.
pub(super) fn figures_or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), figures)
}

/// A budget, a time or an error as the head of a column: no more digits than it has.
pub(super) fn plain(value: f64) -> String {
    if !value.is_finite() {
        return figures(value);
    }
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) { format!("{value:e}") } else { format!("{value}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let all = [0.0, 1.0, 0.012345, 123.4, 98765.0, 1e5, 9.87654e-4, -2.0, f64::NAN, f64::INFINITY].map(figures);
        let expected = ["0", "1.00", "0.0123", "123", "98765", "1.00e5", "9.88e-4", "-2.00", "-", "\u{221e}"];
        assert_eq!(all, expected);
        assert_eq!([9.9999, 0.9996, 9.996e-4, 99999.9].map(figures), ["10.0", "1.00", "0.00100", "1.00e5"]);
        assert_eq!([plain(f64::NAN), plain(f64::INFINITY)], ["-", "\u{221e}"]);
        assert_eq!([plain(0.5), plain(1e-5), plain(30.0), plain(1e9)], ["0.5", "1e-5", "30", "1e9"]);
    }

    #[test]
    fn text_stays_text() {
        let mut table = Table::new("a | b", ["<x>", "y"]);
        assert_eq!((table.html(), table.markdown()), (String::new(), String::new()));
        table.rows.push(vec!["*<script>*\n|".into(), Td { text: "1".into(), strong: true }]);
        let (html, markdown) = (table.html(), table.markdown());
        assert!(html.contains("*&lt;script&gt;*") && html.contains("<td><strong>1</strong></td>"), "{html}");
        assert_eq!(markdown, "a \\| b\n\n| &lt;x&gt; | y |\n|---|---:|\n| \\*&lt;script&gt;\\* \\| | **1** |\n\n");
        crate::plot::well_formed::check(&html).expect("a table");
    }
}
