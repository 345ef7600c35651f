//! Line charts.

use super::canvas::{self, Area, Failed, Graph, LETTERS, LegendEntry, SCALE, Swatch};
use super::{Drawing, Ink, Picture, tick};
use plotters::prelude::*;

/// Width and height of the part above the legend, in CSS pixels: two fit side by side on a sheet of paper, and one
/// is as wide as a phone.
const SIZE: [u32; 2] = [380, 220];

/// An axis of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Label with the unit.
    pub label: String,
    /// Ends of the axis.
    pub range: [f64; 2],
}

impl Scale {
    /// An axis with given ends; if they are equal, a small range around them.
    #[must_use]
    pub fn exact(label: impl Into<String>, [low, high]: [f64; 2]) -> Self {
        let range = match high > low && (high - low).is_finite() {
            true => [low, high],
            false => [low.min(0.0) - 1.0, low.max(0.0) + 1.0],
        };
        Self {
            label: label.into(),
            range,
        }
    }

    /// An axis that covers given values and zero, with a small margin.
    #[must_use]
    pub fn around(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let finite = values.filter(|v| v.is_finite());
        let (low, high) = finite.fold((0.0, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
        let room = 0.06 * (high - low);
        let range = match room > 0.0 {
            true => [
                if low < 0.0 { low - room } else { -0.5 * room },
                high + room,
            ],
            false => [-1.0, 1.0],
        };
        Self::exact(label, range)
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line from point to point.
    Line,
    /// A thin line with gaps.
    Dashed,
    /// Points.
    Points,
}

/// Points drawn together.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; not listed if empty.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// How it is drawn.
    pub mark: Mark,
    /// Points; those that are not finite are omitted.
    pub points: Vec<[f64; 2]>,
}

/// A line chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// A description for people who cannot see it.
    pub title: String,
    /// The horizontal axis.
    pub x: Scale,
    /// The vertical axis.
    pub y: Scale,
    /// Shaded parts of the horizontal axis, in which nothing was measured.
    pub shaded: Vec<[f64; 2]>,
    /// The series, from back to front.
    pub series: Vec<Series>,
}

impl Series {
    fn draw<'a>(&self, chart: &mut Graph<'a>) -> Result<(), Failed<'a>> {
        let finite = self.points.iter().filter(|[x, y]| (x + y).is_finite());
        let points = finite.map(|[x, y]| (*x, *y));
        let style = canvas::line(self.ink, 1.75);
        match self.mark {
            Mark::Line => {
                chart.draw_series(LineSeries::new(points, style))?;
            }
            Mark::Dashed => {
                let [dash, gap] = [5, 4].map(|n| n * SCALE);
                let style = canvas::line(self.ink, 1.25);
                chart.draw_series(DashedLineSeries::new(points, dash, gap, style))?;
            }
            Mark::Points => {
                let size = (2.5 * f64::from(SCALE)) as u32;
                let point = |at| Circle::new(at, size, canvas::fill(self.ink));
                chart.draw_series(points.map(point))?;
            }
        }
        Ok(())
    }
}

impl Drawing for Chart {
    fn legend(&mut self) -> Vec<&mut String> {
        self.series
            .iter_mut()
            .map(|series| &mut series.name)
            .collect()
    }

    fn draw(&self) -> Picture {
        let named = self.series.iter().filter(|series| !series.name.is_empty());
        let named = named.map(|series| LegendEntry {
            name: &series.name,
            ink: series.ink,
            swatch: match series.mark {
                Mark::Line => Swatch::Line,
                Mark::Dashed => Swatch::Dashed,
                Mark::Points => Swatch::Point,
            },
        });
        let entries: Vec<LegendEntry<'_>> = named.collect();
        let [wide, high] = SIZE;
        let legend = canvas::legend_height(&entries, wide);
        canvas::picture(&self.title, [wide, high + legend], |area| {
            let (plot, below) = area.split_vertically(high * SCALE);
            self.curves(&plot)?;
            canvas::legend(&below, &entries, wide)
        })
    }
}

impl Chart {
    fn curves<'a>(&self, area: &Area<'a>) -> Result<(), Failed<'a>> {
        let ([x0, x1], [y0, y1]) = (self.x.range, self.y.range);
        let mut chart = ChartBuilder::on(area)
            .margin_top(8 * SCALE)
            .margin_right(12 * SCALE)
            .x_label_area_size((2 * LETTERS + 14) * SCALE)
            .y_label_area_size((3 * LETTERS + 24) * SCALE)
            .build_cartesian_2d(x0..x1, y0..y1)?;
        for [from, to] in &self.shaded {
            let corners = [(from.max(x0), y0), (to.min(x1), y1)];
            let area = Rectangle::new(corners, canvas::fill(Ink::Shade));
            chart.draw_series([area])?;
        }
        canvas::mesh(&mut chart)
            .y_labels(6)
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .y_label_formatter(&|v| tick(*v))
            .draw()?;
        if y0 < 0.0 && y1 > 0.0 {
            let zero = PathElement::new([(x0, 0.0), (x1, 0.0)], canvas::line(Ink::Muted, 0.75));
            chart.draw_series([zero])?;
        }
        for series in &self.series {
            series.draw(&mut chart)?;
        }
        Ok(())
    }
}
