//! The points of a table, as stored in a blob and in a file.

use trueaxis::Bank;

/// Equidistant points, as in a blob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// The first point (mm, deg).
    pub start: f32,
    /// Spacing of the points (mm, deg).
    pub step: f32,
    /// Number of points; with modulo, the last one, which equals the first, is not counted.
    pub points: usize,
    /// True if the table repeats after `points · step`.
    pub modulo: bool,
}

/// The numbers in a file: MIN, MAX and STEP, with the fewest digits possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrittenSpacing {
    /// `$AN_CEC_MIN`
    pub min: f64,
    /// `$AN_CEC_MAX`
    pub max: f64,
    /// `$AN_CEC_STEP`
    pub step: f64,
}

/// Permitted deviation of (MAX − MIN)/STEP from a whole number, as a fraction of it: far above f64 rounding, far
/// below the effect of a truncated decimal of STEP.
const WHOLE: f64 = 1e-9;

impl Spacing {
    /// The points of a bank of linear tables.
    pub fn of(bank: &Bank) -> Self {
        Self {
            start: bank.start,
            step: bank.step,
            points: bank.points as usize,
            modulo: bank.modulo,
        }
    }

    /// Number of intervals between MIN and MAX.
    pub fn intervals(&self) -> usize {
        match self.modulo {
            true => self.points,
            false => self.points - 1,
        }
    }

    /// Position of a point (mm, deg).
    pub fn at(&self, point: usize) -> f64 {
        f64::from(self.start) + point as f64 * f64::from(self.step)
    }

    /// The last point; with modulo, where the first one is repeated (mm, deg).
    pub fn end(&self) -> f64 {
        self.at(self.intervals())
    }

    /// The shortest numbers that read back as this.
    pub fn written(&self) -> WrittenSpacing {
        let intervals = self.intervals() as f64;
        let min = shortest(self.start);
        // From the number as written, which differs slightly from the f32 that it represents.
        let end = min + intervals * f64::from(self.step);
        let max = (0..=17)
            .map(|decimals| rounded(end, decimals))
            .find(|max| ((max - min) / intervals) as f32 == self.step)
            .unwrap_or(end);
        let exact = (max - min) / intervals;
        // Never above: a controller that truncates the quotient would lose the last point.
        let fits = |step: &f64| {
            *step as f32 == self.step
                && (max - min) / step >= intervals
                && whole(max - min, *step).is_some()
        };
        let near = |decimals: usize| {
            let below = exact - 0.5 * libm::exp10(-(decimals as f64));
            [exact, below].map(|step| rounded(step, decimals))
        };
        let step = (0..=17).flat_map(near).find(fits);
        WrittenSpacing {
            min,
            max,
            step: step.unwrap_or(exact),
        }
    }
}

/// Quotient of `span` and `step`, if it is a whole number.
pub fn whole(span: f64, step: f64) -> Option<f64> {
    let times = span / step;
    let nearest = times.round();
    ((times - nearest).abs() <= WHOLE * nearest.max(1.0)).then_some(nearest)
}

/// The decimal number as which an f32 is printed.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| value.into())
}

fn rounded(value: f64, decimals: usize) -> f64 {
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(written: &WrittenSpacing, points: usize, modulo: bool) -> Spacing {
        Spacing {
            start: written.min as f32,
            step: written.step as f32,
            points,
            modulo,
        }
    }

    #[test]
    fn a_turn_in_seven_parts_ends_where_it_began() {
        let spacing = Spacing {
            start: -180.0,
            step: 360.0 / 7.0,
            points: 7,
            modulo: true,
        };
        let written = spacing.written();
        assert_eq!((written.min, written.max), (-180.0, 180.0));
        assert_eq!(whole(360.0, written.step), Some(7.0));
    }

    #[test]
    fn a_controller_that_truncates_reaches_the_last_point() {
        // 17.0212766 · 47 is more than 800.
        let spacing = Spacing {
            start: 0.0,
            step: 800.0 / 47.0,
            points: 48,
            modulo: false,
        };
        let written = spacing.written();
        assert_eq!(written.max, 800.0);
        assert_eq!((written.max / written.step).trunc(), 47.0, "{written:?}");
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_as_the_same_points(
            start in -1000.0_f32..1000.0,
            span in 1.0_f32..2000.0,
            points in 2_usize..3000,
            modulo: bool,
        ) {
            let step = span / points as f32;
            let spacing = Spacing { start, step, points, modulo };
            let written = spacing.written();
            prop_assert_eq!(read(&written, points, modulo), spacing);
            let times = whole(written.max - written.min, written.step);
            prop_assert_eq!(times, Some(spacing.intervals() as f64));
            let reached = (written.max - written.min) / written.step;
            prop_assert!(reached >= spacing.intervals() as f64, "{:?}", written);
        }
    }
}
