//! Static pictures: from data to SVG, for reports and for the manual.
//!
//! Colours are names that a page defines ([`Ink`]), so that one picture serves light and dark pages; a picture in
//! its own file contains both. The same data give the same bytes.

mod bars;
mod canvas;
mod chart;
mod polar;

pub use bars::{Bars, ChartBar};
pub use chart::{Chart, Mark, Scale, Series};
pub use polar::{Polar, PolarTurn};

use std::fmt::Write;

/// The role of a line or an area, which determines its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Text.
    Text,
    /// Secondary text, and axes.
    Muted,
    /// Lines of a grid.
    Grid,
    /// Without correction.
    Before,
    /// With correction.
    After,
    /// Something without a counterpart: a curve, a bar.
    Accent,
    /// The second of two similar things, such as the negative direction of travel.
    Other,
    /// An area in the background, where nothing was measured.
    Shade,
}

/// Every ink with its name in a style sheet and its colours on light and on dark paper. The first number represents
/// it while a picture is being drawn.
const INKS: [(Ink, u8, &str, &str, &str); 8] = [
    (Ink::Text, 1, "ink", "#1b2229", "#e6e9ec"),
    (Ink::Muted, 2, "muted", "#56616b", "#a3adb6"),
    (Ink::Grid, 3, "grid", "#d5dade", "#3a434b"),
    (Ink::Before, 4, "before", "#b3470b", "#f0995a"),
    (Ink::After, 5, "after", "#0b6e4f", "#5fc9a3"),
    (Ink::Accent, 6, "accent", "#1f5fa8", "#7db4f0"),
    (Ink::Other, 7, "other", "#8a3c8f", "#d79adb"),
    (Ink::Shade, 8, "shade", "#e3ecf4", "#26323d"),
];

/// Light and dark paper.
const PAPER: [&str; 2] = ["#ffffff", "#14191e"];

impl Ink {
    /// The colour that represents it while a picture is being drawn.
    fn sentinel(self) -> plotters::style::RGBColor {
        let found = INKS.iter().find(|(ink, ..)| *ink == self);
        let number = found.map_or(0, |(_, number, ..)| *number);
        plotters::style::RGBColor(254, number, 1)
    }
}

/// A drawn picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// A description of its content.
    title: String,
    /// Width and height in CSS pixels.
    size: [u32; 2],
    /// The content of the `svg` element; its colours are variables of a style sheet.
    content: String,
}

/// Something that can be drawn.
pub trait Drawing {
    /// The names in its legend; one that is empty is not listed.
    fn legend(&mut self) -> Vec<&mut String>;

    /// Draws it, with its legend.
    fn draw(&self) -> Picture;
}

/// Margin on all sides in CSS pixels: numbers at the ends of an axis extend beyond it.
const EDGE: u32 = 9;

impl Picture {
    /// Width and height in CSS pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// An `svg` element for a page whose style sheet has the variables `--ink`, `--muted`, `--grid`, `--before`,
    /// `--after`, `--accent`, `--other` and `--shade`.
    #[must_use]
    pub fn inline(&self) -> String {
        let [width, height] = self.size.map(|size| size + 2 * EDGE);
        let scale = canvas::SCALE;
        let edge = EDGE * scale;
        format!(
            "<svg viewBox=\"-{edge} -{edge} {} {}\" width=\"{width}\" height=\"{height}\" role=\"img\" \
             aria-label=\"{}\">\n{}</svg>\n",
            width * scale,
            height * scale,
            escaped(&self.title),
            self.content
        )
    }

    /// A file of its own, light or dark according to the reader's preference, with its title above the drawing.
    /// Colours are attributes, because programs other than browsers do not know variables; a browser on dark paper
    /// replaces them.
    #[must_use]
    pub fn file(&self) -> String {
        let mut content = self.content.clone();
        let mut dark = String::new();
        let mut replace = |light: &str, other: &str| {
            let _ = write!(
                dark,
                "[fill=\"{light}\"]{{fill:{other}}}[stroke=\"{light}\"]{{stroke:{other}}}"
            );
        };
        let [paper, dark_paper] = PAPER;
        replace(paper, dark_paper);
        for (_, _, name, light, other) in INKS {
            content = content.replace(&format!("\"var(--{name})\""), &format!("\"{light}\""));
            replace(light, other);
        }
        let titles = canvas::wrapped(&self.title, self.size[0]);
        let above = canvas::LINE * titles.len() as u32;
        let [width, height] = [self.size[0], self.size[1] + above].map(|size| size + 2 * EDGE);
        let scale = canvas::SCALE;
        let [left, top] = [EDGE, EDGE + above].map(|edge| edge * scale);
        let box_size = [width, height].map(|size| size * scale);
        let title = heading(&titles);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-{left} -{top} {} {}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\" aria-label=\"{}\">\n\
             <style>@media(prefers-color-scheme:dark){{{dark}}}</style>\n\
             <rect x=\"-{left}\" y=\"-{top}\" width=\"{}\" height=\"{}\" fill=\"{paper}\"/>\n{title}{content}</svg>\n",
            box_size[0],
            box_size[1],
            escaped(&self.title),
            box_size[0],
            box_size[1],
        )
    }
}

/// Lines of text above a drawing.
fn heading(lines: &[String]) -> String {
    let line = canvas::LINE;
    let above = line * lines.len() as u32;
    lines.iter().enumerate().fold(String::new(), |mut text, (k, words)| {
        let _ = writeln!(
            text,
            "<text x=\"0\" y=\"-{}\" font-family=\"sans-serif\" font-size=\"{}\" fill=\"{}\">{}</text>",
            (above - line * (k as u32 + 1) + line / 3) * canvas::SCALE,
            canvas::LETTERS * canvas::SCALE,
            INKS[0].3,
            escaped(words)
        );
        text
    })
}

/// Escapes text for an attribute or between tags.
#[must_use]
pub(crate) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // XML permits no other control characters.
            c if c.is_control() && c != '\n' && c != '\t' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A number at an axis: with as many digits as needed, a power of ten instead of many zeros, and a true minus sign.
#[must_use]
pub(crate) fn tick(value: f64) -> String {
    // Removes rounding errors from sums of steps.
    let rounded = format!("{value:.9}");
    let short = rounded.trim_end_matches('0').trim_end_matches('.');
    match short {
        "-0" | "" | "0" => "0".to_owned(),
        short => match short.parse::<f64>() {
            // Not of `value`, which may be a rounding error off, another one on each system.
            Ok(rounded) if rounded.abs() < 1e-5 => format!("{rounded:e}").replace('-', "−"),
            _ => short.replace('-', "−"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(title: &str, name: &str) -> Picture {
        let points: Vec<[f64; 2]> = (0..=20).map(|k| [f64::from(k), f64::from(k * k)]).collect();
        let values = points.iter().map(|p| p[1]);
        Chart {
            title: title.to_owned(),
            x: Scale::exact("X (mm)", [0.0, 20.0]),
            y: Scale::around("EXX (µm)", values),
            shaded: vec![[2.0, 8.0]],
            series: vec![Series {
                name: name.to_owned(),
                ink: Ink::Accent,
                mark: Mark::Line,
                points,
            }],
        }
        .draw()
    }

    #[test]
    fn a_picture_has_no_colour_but_variables_and_inline_no_address() {
        let picture = chart("t", "s").inline();
        assert!(
            !picture.contains('#') && !picture.contains("http"),
            "{picture}"
        );
        for name in ["ink", "muted", "grid", "accent", "shade"] {
            assert!(picture.contains(&format!("var(--{name})")), "{name}");
        }
        assert!(!picture.contains("var(--before)"));
    }

    #[test]
    fn a_file_has_literal_colours_with_one_for_dark_paper_each_and_its_title() {
        let file = chart("the title", "s").file();
        assert!(!file.contains("var("), "{file}");
        let (style, drawing) = file.split_once("</style>").unwrap();
        for (_, _, name, light, dark) in INKS {
            assert!(
                style.contains(&format!("[fill=\"{light}\"]{{fill:{dark}}}")),
                "{name}"
            );
            assert!(
                style.contains(&format!("[stroke=\"{light}\"]{{stroke:{dark}}}")),
                "{name}"
            );
        }
        for colour in drawing.split('#').skip(1) {
            let known = INKS.iter().any(|ink| colour.starts_with(&ink.3[1..]));
            assert!(known || colour.starts_with(&PAPER[0][1..]), "#{colour}");
        }
        assert!(drawing.contains(">the title</text>"));
    }

    #[test]
    fn names_are_text() {
        let picture = chart("<b>\"&", "</svg><script>").inline();
        assert!(picture.contains("&lt;/svg&gt;&lt;script&gt;"), "{picture}");
        assert!(picture.contains("aria-label=\"&lt;b&gt;&quot;&amp;\""));
        assert!(!picture.contains("<script") && picture.matches("</svg>").count() == 1);
    }

    #[test]
    fn axes_have_their_names_units_and_numbers_and_a_legend() {
        let picture = chart("t", "a curve").inline();
        for text in ["X (mm)", "EXX (µm)", "a curve", ">\n10\n<"] {
            assert!(picture.contains(text), "{text}: {picture}");
        }
    }

    #[test]
    fn numbers_at_axes_have_no_digits_of_rounding() {
        assert_eq!(tick(0.1 + 0.2), "0.3");
        assert_eq!(tick(-0.000_05), "−0.00005");
        assert_eq!(tick(-0.000_002), "−2e−6");
        for rounding in [-1e-18, 0.0, 1e-18] {
            assert_eq!(tick(0.000_01 + rounding), "0.00001");
        }
        assert_eq!(tick(-0.0), "0");
        assert_eq!(tick(100.0), "100");
    }

    #[test]
    fn the_least_contrast_of_text_is_that_of_readable_text() {
        // WCAG 2: relative luminance of the paper and of all text colours.
        let luminance = |colour: &str| {
            let part = |k: usize| {
                let byte = u8::from_str_radix(&colour[1 + 2 * k..3 + 2 * k], 16).unwrap();
                let c = f64::from(byte) / 255.0;
                match c <= 0.040_45 {
                    true => c / 12.92,
                    false => libm::pow((c + 0.055) / 1.055, 2.4),
                }
            };
            0.2126 * part(0) + 0.7152 * part(1) + 0.0722 * part(2)
        };
        for (ink, _, name, light, dark) in INKS {
            if matches!(ink, Ink::Grid | Ink::Shade) {
                continue;
            }
            for (paper, shade, colour) in
                [("#ffffff", "#e3ecf4", light), ("#14191e", "#26323d", dark)]
            {
                for behind in [paper, shade] {
                    let (a, b) = (luminance(behind), luminance(colour));
                    let contrast = (a.max(b) + 0.05) / (a.min(b) + 0.05);
                    assert!(contrast >= 4.5, "{name} on {behind}: {contrast}");
                }
            }
        }
    }
}
