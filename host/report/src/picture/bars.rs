//! Bar charts with a name for each bar.

use super::canvas::{self, Area, Failed, Graph, LETTERS, LegendEntry, SCALE, Swatch};
use super::{Drawing, Ink, Picture};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// Width in CSS pixels.
const WIDE: u32 = 380;
/// Height of a row in CSS pixels.
const ROW: u32 = 21;

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartBar {
    /// Name of the bar.
    pub name: String,
    /// The length of the dark bar.
    pub mean: f64,
    /// The end of the light line that continues it.
    pub max: f64,
    /// The half length of the whisker at the end of the light line, if any.
    pub uncertainty: Option<f64>,
}

/// Bars with a mean and a maximum each.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// A description for people who cannot see it.
    pub title: String,
    /// Label of the axis, with its unit.
    pub label: String,
    /// Names in the legend, for the dark bar, the light line, the whisker; not listed if empty.
    pub legend: [String; 3],
    /// The colour of bars.
    pub ink: Ink,
    /// The bars from top to bottom.
    pub bars: Vec<ChartBar>,
}

impl Drawing for Bars {
    fn legend(&mut self) -> Vec<&mut String> {
        self.legend.iter_mut().collect()
    }

    fn draw(&self) -> Picture {
        let is_uncertain = self.bars.iter().any(|bar| bar.uncertainty.is_some());
        let marks = [
            (self.ink, Swatch::Area),
            (self.ink, Swatch::Line),
            (Ink::Text, Swatch::Line),
        ];
        let named = self
            .legend
            .iter()
            .zip(marks)
            .take(2 + usize::from(is_uncertain));
        let entries: Vec<LegendEntry<'_>> = named
            .filter(|(name, _)| !name.is_empty())
            .map(|(name, (ink, swatch))| LegendEntry { name, ink, swatch })
            .collect();
        let high = self.bars.len() as u32 * ROW + 2 * LETTERS + 26;
        let legend = canvas::legend_height(&entries, WIDE);
        canvas::picture(&self.title, [WIDE, high + legend], |area| {
            let (plot, below) = area.split_vertically(high * SCALE);
            self.rows(&plot)?;
            canvas::legend(&below, &entries, WIDE)
        })
    }
}

impl Bars {
    fn rows<'a>(&self, area: &Area<'a>) -> Result<(), Failed<'a>> {
        let names = self.bars.iter().map(|bar| canvas::width(&bar.name));
        let names = names.max().unwrap_or(0) + 10 * SCALE as i32;
        let ends = self
            .bars
            .iter()
            .map(|bar| bar.max.max(bar.mean + bar.uncertainty.unwrap_or(0.0)));
        let most = ends.filter(|end| end.is_finite()).fold(0.0, f64::max);
        let most = if most > 0.0 { 1.05 * most } else { 1.0 };
        let rows = self.bars.len() as f64;
        let mut chart = ChartBuilder::on(area)
            .margin_top(4 * SCALE)
            .margin_right(14 * SCALE)
            .x_label_area_size((2 * LETTERS + 14) * SCALE)
            .y_label_area_size(names)
            .build_cartesian_2d(0.0..most, rows..0.0)?;
        canvas::mesh(&mut chart)
            .disable_y_mesh()
            .disable_y_axis()
            .x_desc(&self.label)
            .draw()?;
        for (row, bar) in self.bars.iter().enumerate() {
            let middle = row as f64 + 0.5;
            self.bar(&mut chart, bar, middle, most)?;
            let (x, y) = chart.backend_coord(&(0.0, middle));
            let place = (x - 6 * SCALE as i32, y);
            let style = canvas::letters_at(Ink::Text, HPos::Right, VPos::Center);
            area.draw(&Text::new(bar.name.clone(), place, style))?;
        }
        Ok(())
    }

    /// A bar, its line and its whisker, around a height; nothing of it is beyond `most`.
    fn bar<'a>(
        &self,
        chart: &mut Graph<'a>,
        bar: &ChartBar,
        middle: f64,
        most: f64,
    ) -> Result<(), Failed<'a>> {
        let corners = [(0.0, middle - 0.3), (bar.mean, middle + 0.3)];
        let line = |x: [f64; 2], ink, width| {
            PathElement::new([(x[0], middle), (x[1], middle)], canvas::line(ink, width))
        };
        chart.draw_series([Rectangle::new(corners, canvas::fill(self.ink))])?;
        chart.draw_series([line([0.0, bar.max], self.ink, 3.0)])?;
        if let Some(u) = bar.uncertainty {
            let ends = [(bar.mean - u).max(0.0), (bar.mean + u).min(most)];
            chart.draw_series([line(ends, Ink::Text, 1.25)])?;
            let cap = |x: f64| {
                let ends = [(x, middle - 0.2), (x, middle + 0.2)];
                PathElement::new(ends, canvas::line(Ink::Text, 1.25))
            };
            chart.draw_series(ends.map(cap))?;
        }
        Ok(())
    }
}
