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
            self.rings(&plot, step)?;
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

    fn rings<'a>(&self, area: &Area<'a>, step: f64) -> Result<(), Failed<'a>> {
        let [wide, high] = SIZE.map(|n| (n * SCALE) as i32);
        let (x0, y0) = (wide / 2, high / 2);
        let outermost = f64::from(high / 2) - f64::from((LETTERS + 8) * SCALE);
        let ring = (1.0 - ZERO) / 2.0;
        let at = |angle: f64, deviation: f64| {
            let r = outermost * (ZERO + ring * deviation / step);
            let (sine, cosine) = libm::sincos(angle);
            (
                x0 + (r * cosine).round() as i32,
                y0 - (r * sine).round() as i32,
            )
        };
        let circle = |deviation: f64| {
            (0..=180)
                .map(move |k| (f64::from(k) * 2.0).to_radians())
                .map(move |a| at(a, deviation))
        };
        for k in -2..=2 {
            let (ink, width) = if k == 0 {
                (Ink::Muted, 1.25)
            } else {
                (Ink::Grid, 0.75)
            };
            let points: Vec<_> = circle(f64::from(k) * step).collect();
            area.draw(&PathElement::new(points, canvas::line(ink, width)))?;
        }
        for quarter in [0.0, 90.0, 180.0, 270.0_f64] {
            let ends = [
                at(quarter.to_radians(), -3.0 * step),
                at(quarter.to_radians(), 2.0 * step),
            ];
            area.draw(&PathElement::new(ends, canvas::line(Ink::Grid, 0.75)))?;
        }
        for turn in &self.turns {
            let finite = turn.readings.iter().filter(|(_, r)| r.is_finite());
            let points: Vec<_> = finite.map(|(angle, r)| at(*angle, *r)).collect();
            if points.len() > 1 {
                area.draw(&PathElement::new(points, canvas::line(turn.ink, 1.75)))?;
            }
        }
        let slanted = 67.5_f64.to_radians();
        for k in [-2, -1, 0, 1, 2] {
            let deviation = f64::from(k) * step;
            let sign = if k > 0 { "+" } else { "" };
            let text = match k {
                0 => format!("0 {}", self.unit),
                _ => format!("{sign}{}", tick(deviation)),
            };
            let style = canvas::letters_at(Ink::Muted, HPos::Center, VPos::Center);
            area.draw(&Text::new(text, at(slanted, deviation), style))?;
        }
        let gap = 6 * SCALE as i32;
        let (x, y) = at(0.0, 2.0 * step);
        let style = canvas::letters_at(Ink::Text, HPos::Left, VPos::Center);
        area.draw(&Text::new(
            format!("+{}", self.axes[0]),
            (x + gap, y),
            style,
        ))?;
        let (x, y) = at(std::f64::consts::FRAC_PI_2, 2.0 * step);
        let style = canvas::letters_at(Ink::Text, HPos::Center, VPos::Bottom);
        area.draw(&Text::new(
            format!("+{}", self.axes[1]),
            (x, y - gap),
            style,
        ))
    }
}
