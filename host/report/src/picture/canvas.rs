//! The drawing surface of pictures: the backend of `plotters`, colours, text and legends.

use super::{INKS, Ink, Picture, escaped, tick};
use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Drawing units per CSS pixel: `plotters` only has whole units, and curves would otherwise be rough.
pub const SCALE: u32 = 4;
/// Font size in CSS pixels.
pub const LETTERS: u32 = 12;
/// Height of a line of text in CSS pixels.
pub const LINE: u32 = LETTERS + 5;
/// Width of a character relative to the font size, an upper limit for common fonts.
const WIDE: f64 = 0.58;

/// An area to draw on; drawing into memory cannot fail.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// The error of `plotters` if a backend fails, which one in memory does not.
pub type Failed<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

/// A plane with numbers at both axes.
pub type Graph<'a> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The grid of a graph, with numbers along its horizontal axis.
pub fn mesh<'a, 'g>(
    graph: &'g mut Graph<'a>,
) -> MeshStyle<'a, 'g, RangedCoordf64, RangedCoordf64, SVGBackend<'a>> {
    let mut mesh = graph.configure_mesh();
    mesh.x_labels(6)
        .x_label_formatter(&|v| tick(*v))
        .axis_desc_style(letters(Ink::Text))
        .label_style(letters(Ink::Muted))
        .axis_style(line(Ink::Muted, 1.0))
        .bold_line_style(line(Ink::Grid, 0.75))
        .light_line_style(TRANSPARENT)
        .set_all_tick_mark_size(4 * SCALE);
    mesh
}

/// Draws a picture with a size in CSS pixels.
pub fn picture(
    title: &str,
    size: [u32; 2],
    draw: impl for<'a> FnOnce(&Area<'a>) -> Result<(), Failed<'a>>,
) -> Picture {
    let mut text = String::new();
    let failed = {
        let backend = SVGBackend::with_string(&mut text, (size[0] * SCALE, size[1] * SCALE));
        let area = backend.into_drawing_area();
        let drawn = draw(&area).and_then(|()| area.present());
        drawn.err().map(|error| error.to_string())
    };
    // Drawing only writes to memory, and coordinates are finite; report a failure in debug builds.
    debug_assert!(failed.is_none(), "{failed:?}");
    // The element itself is written again; see `Picture::element`.
    let start = text.find('>').map_or(0, |at| at + 2);
    let end = text.rfind("</svg>").unwrap_or(text.len());
    let mut content = match failed {
        None => text[start..end].to_owned(),
        Some(error) => {
            let high = LETTERS * SCALE;
            let words = escaped(&error);
            format!("<text y=\"{high}\" font-size=\"{high}\" fill=\"var(--ink)\">{words}</text>\n")
        }
    };
    for (ink, _, name, ..) in INKS {
        let RGBColor(r, g, b) = ink.sentinel();
        content = content.replace(
            &format!("\"#{r:02X}{g:02X}{b:02X}\""),
            &format!("\"var(--{name})\""),
        );
    }
    Picture {
        title: title.to_owned(),
        size,
        content: content.replace(" opacity=\"1\"", ""),
    }
}

/// A text style of an ink.
pub fn letters(ink: Ink) -> TextStyle<'static> {
    // For SVG, `plotters` divides the font size by 1.24.
    let height = f64::from(LETTERS * SCALE) * 1.24;
    ("sans-serif", height).into_font().color(&ink.sentinel())
}

/// The style of letters that are anchored at a point.
pub(crate) fn letters_at(ink: Ink, h: HPos, v: VPos) -> TextStyle<'static> {
    letters(ink).pos(Pos::new(h, v))
}

/// A line of a width in CSS pixels.
pub fn line(ink: Ink, width: f64) -> ShapeStyle {
    ShapeStyle {
        color: ink.sentinel().into(),
        filled: false,
        stroke_width: (width * f64::from(SCALE)).round() as u32,
    }
}

/// An area.
pub fn fill(ink: Ink) -> ShapeStyle {
    ink.sentinel().filled()
}

/// Approximate width of a text in drawing units.
pub fn width(text: &str) -> i32 {
    let letter = WIDE * f64::from(LETTERS * SCALE);
    (text.chars().count() as f64 * letter).round() as i32
}

/// A text in lines of at most a width in CSS pixels.
pub fn wrapped(text: &str, wide: u32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}")) <= (wide * SCALE) as i32 => {
                *line = format!("{line} {word}");
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The symbol of a legend entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Swatch {
    /// A line.
    Line,
    /// A line with gaps.
    Dashed,
    /// A point.
    Point,
    /// An area.
    Area,
}

/// An entry of a legend.
pub struct LegendEntry<'a> {
    pub name: &'a str,
    pub ink: Ink,
    pub swatch: Swatch,
}

/// Height (CSS pixels) of a legend below a picture of a given width (CSS pixels).
pub(crate) fn legend_height(entries: &[LegendEntry<'_>], wide: u32) -> u32 {
    let rows = placed(entries, wide);
    rows.last()
        .map_or(0, |(row, _)| (*row as u32 + 1) * LINE + 4)
}

/// Row and horizontal position of each entry.
fn placed(entries: &[LegendEntry<'_>], wide: u32) -> Vec<(i32, i32)> {
    let [swatch, gap] = [24, 14].map(|n| n * SCALE as i32);
    let (mut row, mut x) = (0, 0);
    let place = |entry: &LegendEntry<'_>| {
        let needs = swatch + width(entry.name) + gap;
        if x > 0 && x + needs > (wide * SCALE) as i32 {
            (row, x) = (row + 1, 0);
        }
        let at = (row, x);
        x += needs;
        at
    };
    entries.iter().map(place).collect()
}

/// Draws a legend.
pub fn legend<'a>(
    area: &Area<'a>,
    entries: &[LegendEntry<'_>],
    wide: u32,
) -> Result<(), Failed<'a>> {
    let unit = SCALE as i32;
    let high = LINE as i32 * unit;
    for (entry, (row, x)) in entries.iter().zip(placed(entries, wide)) {
        let middle = row * high + high / 2;
        let [from, to] = [x + 2 * unit, x + 20 * unit];
        let style = line(entry.ink, 2.0);
        match entry.swatch {
            Swatch::Line => area.draw(&PathElement::new([(from, middle), (to, middle)], style))?,
            Swatch::Dashed => {
                for start in [from, from + 7 * unit, from + 14 * unit] {
                    let piece = [(start, middle), (start + 4 * unit, middle)];
                    area.draw(&PathElement::new(piece, style))?;
                }
            }
            Swatch::Point => {
                let centre = ((from + to) / 2, middle);
                area.draw(&Circle::new(centre, 3 * unit, fill(entry.ink)))?;
            }
            Swatch::Area => {
                let corners = [(from, middle - 5 * unit), (to, middle + 5 * unit)];
                area.draw(&Rectangle::new(corners, fill(entry.ink)))?;
            }
        }
        let style = letters_at(Ink::Text, HPos::Left, VPos::Center);
        area.draw(&Text::new(entry.name, (x + 24 * unit, middle), style))?;
    }
    Ok(())
}
