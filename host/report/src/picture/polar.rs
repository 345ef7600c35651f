//! Polar plots of deviations from a circle, as in ISO 230-4.

use super::canvas::{self, Area, Failed, LETTERS, LegendEntry, SCALE, Swatch};
use super::{Drawing, Ink, Picture, tick};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// Width and height of the part above the legend, in CSS pixels.
const SIZE: [u32; 2] = [360, 330];
/// Radius of the circle of zero deviation, relative to the outermost circle.
const ZERO: f64 = 0.6;

/// One turn around the circle.
#[derive(Clone, Debug, PartialEq)]
pub struct PolarTurn {
    /// Name in the legend; not listed if empty.
    pub name: String,
    /// Colour.
    pub ink: Ink,
    /// Angles (rad) from the first axis towards the second, and deviations.
    pub readings: Vec<(f64, f64)>,
}

/// A polar plot of deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Polar {
    /// A description for people who cannot see it.
    pub title: String,
    /// Names of the axes, to the right and upwards.
    pub axes: [String; 2],
    /// Unit of the deviations.
    pub unit: String,
    /// The turns.
    pub turns: Vec<PolarTurn>,
}

impl Drawing for Polar {
    fn legend(&mut self) -> Vec<&mut String> {
        self.turns.iter_mut().map(|turn| &mut turn.name).collect()
    }

    fn draw(&self) -> Picture {
        let step = self.step();
        let turns = self.turns.iter().filter(|turn| !turn.name.is_empty());
        let turns = turns.map(|turn| LegendEntry {
            name: &turn.name,
            ink: turn.ink,
            swatch: Swatch::Line,
        });
        let entries: Vec<LegendEntry<'_>> = turns.collect();
        let [wide, high] = SIZE;
        let legend = canvas::legend_height(&entries, wide);
        canvas::picture(&self.title, [wide, high + legend], |area| {
            let (plot, below) = area.split_vertically(high * SCALE);
            let graph = PolarGraph::new(self, &plot, step);
            graph.rings()?;
            graph.curves()?;
            graph.labels()?;
            canvas::legend(&below, &entries, wide)
        })
    }
}

impl Polar {
    /// Deviation from ring to ring: 1, 2 or 5 times a power of ten, such that two rings contain everything.
    fn step(&self) -> f64 {
        let readings = self.turns.iter().flat_map(|turn| &turn.readings);
        let finite = readings.map(|(_, r)| r.abs()).filter(|r| r.is_finite());
        let most = finite.fold(0.0, f64::max);
        if most <= 0.0 {
            return 1.0;
        }
        let power = libm::pow(10_f64, libm::log10(most / 2.0).floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|k| k * power);
        let enough = steps.into_iter().find(|step| 2.0 * step >= most);
        enough.unwrap_or(10.0 * power)
    }
}

/// The part of the drawing above the legend.
struct PolarGraph<'p, 'a> {
    polar: &'p Polar,
    area: &'p Area<'a>,
    /// Deviation from ring to ring.
    step: f64,
    centre: [i32; 2],
    /// Radius of the outermost circle (pixels).
    outermost: f64,
}

impl<'p, 'a> PolarGraph<'p, 'a> {
    fn new(polar: &'p Polar, area: &'p Area<'a>, step: f64) -> Self {
        let centre = SIZE.map(|n| (n * SCALE) as i32 / 2);
        Self {
            polar,
            area,
            step,
            centre,
            outermost: f64::from(centre[1]) - f64::from((LETTERS + 8) * SCALE),
        }
    }

    /// The pixel of a deviation at an angle (rad).
    fn at(&self, angle: f64, deviation: f64) -> (i32, i32) {
        let ring = (1.0 - ZERO) / 2.0;
        let r = self.outermost * (ZERO + ring * deviation / self.step);
        let (sine, cosine) = libm::sincos(angle);
        let [x0, y0] = self.centre;
        (
            x0 + (r * cosine).round() as i32,
            y0 - (r * sine).round() as i32,
        )
    }

    /// Circles of constant deviation, and the axes.
    fn rings(&self) -> Result<(), Failed<'a>> {
        for k in -2..=2 {
            let (ink, width) = if k == 0 {
                (Ink::Muted, 1.25)
            } else {
                (Ink::Grid, 0.75)
            };
            let deviation = f64::from(k) * self.step;
            let angles = (0..=180).map(|k| (f64::from(k) * 2.0).to_radians());
            let points: Vec<_> = angles.map(|angle| self.at(angle, deviation)).collect();
            self.line(points, ink, width)?;
        }
        for quarter in [0.0, 90.0, 180.0, 270.0_f64] {
            let ends = [-3.0, 2.0].map(|rings| self.at(quarter.to_radians(), rings * self.step));
            self.line(ends.to_vec(), Ink::Grid, 0.75)?;
        }
        Ok(())
    }

    fn curves(&self) -> Result<(), Failed<'a>> {
        for turn in &self.polar.turns {
            let finite = turn.readings.iter().filter(|(_, r)| r.is_finite());
            let points: Vec<_> = finite.map(|(angle, r)| self.at(*angle, *r)).collect();
            if points.len() > 1 {
                self.line(points, turn.ink, 1.75)?;
            }
        }
        Ok(())
    }

    /// Deviations of the rings, and names of the axes.
    fn labels(&self) -> Result<(), Failed<'a>> {
        let slanted = 67.5_f64.to_radians();
        for k in [-2, -1, 0, 1, 2] {
            let deviation = f64::from(k) * self.step;
            let sign = if k > 0 { "+" } else { "" };
            let text = match k {
                0 => format!("0 {}", self.polar.unit),
                _ => format!("{sign}{}", tick(deviation)),
            };
            let style = canvas::letters_at(Ink::Muted, HPos::Center, VPos::Center);
            let place = self.at(slanted, deviation);
            self.area.draw(&Text::new(text, place, style))?;
        }
        let gap = 6 * SCALE as i32;
        let [right, up] = self.polar.axes.each_ref().map(|axis| format!("+{axis}"));
        let (x, y) = self.at(0.0, 2.0 * self.step);
        let style = canvas::letters_at(Ink::Text, HPos::Left, VPos::Center);
        self.area.draw(&Text::new(right, (x + gap, y), style))?;
        let (x, y) = self.at(std::f64::consts::FRAC_PI_2, 2.0 * self.step);
        let style = canvas::letters_at(Ink::Text, HPos::Center, VPos::Bottom);
        self.area.draw(&Text::new(up, (x, y - gap), style))
    }

    fn line(&self, points: Vec<(i32, i32)>, ink: Ink, width: f64) -> Result<(), Failed<'a>> {
        let style = canvas::line(ink, width);
        self.area.draw(&PathElement::new(points, style))
    }
}
