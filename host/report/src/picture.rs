//! Static pictures: from data to SVG, for reports and for the manual.
//!
//! Colours are names that a page defines ([`Ink`]), so that one picture serves light and dark pages; a picture in
//! its own file contains both. The same data give the same bytes.

mod bars;
mod canvas;
mod chart;
mod polar;

pub use bars::{Bar, Bars};
pub use chart::{Chart, Mark, Scale, Series};
pub use polar::{Polar, Turn};

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
        self.element("", "")
    }

    /// A file of its own, light or dark according to the reader's preference.
    #[must_use]
    pub fn file(&self) -> String {
        let variables = |dark: bool| {
            INKS.iter().fold(String::new(), |mut text, ink| {
                let _ = write!(text, "--{}:{};", ink.2, if dark { ink.4 } else { ink.3 });
                text
            })
        };
        let style = format!(
            "<style>svg{{background:#fff;{}}}@media(prefers-color-scheme:dark){{svg{{background:#14191e;{}}}}}</style>\n",
            variables(false),
            variables(true)
        );
        self.element(" xmlns=\"http://www.w3.org/2000/svg\"", &style)
    }

    fn element(&self, namespace: &str, style: &str) -> String {
        let [width, height] = self.size.map(|size| size + 2 * EDGE);
        let scale = canvas::SCALE;
        let edge = EDGE * scale;
        format!(
            "<svg{namespace} viewBox=\"-{edge} -{edge} {} {}\" width=\"{width}\" height=\"{height}\" role=\"img\" \
             aria-label=\"{}\">\n{style}{}</svg>\n",
            width * scale,
            height * scale,
            escaped(&self.title),
            self.content
        )
    }
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
        short if value.abs() < 1e-5 => {
            let shortest: f64 = short.parse().unwrap_or(value);
            format!("{shortest:e}").replace('-', "−")
        }
        short => short.replace('-', "−"),
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
    fn a_file_has_a_colour_for_each_variable_in_both_schemes() {
        let file = chart("t", "s").file();
        for (_, _, name, light, dark) in INKS {
            assert!(file.contains(&format!("--{name}:{light};")));
            assert!(file.contains(&format!("--{name}:{dark};")));
        }
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
        for text in ["X (mm)", "EXX (µm)", "a curve", "not measured", ">\n10\n<"] {
            assert!(picture.contains(text), "{text}: {picture}");
        }
    }

    #[test]
    fn numbers_at_axes_have_no_digits_of_rounding() {
        assert_eq!(tick(0.1 + 0.2), "0.3");
        assert_eq!(tick(-0.000_05), "−0.00005");
        assert_eq!(tick(-0.000_002), "−2e−6");
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
