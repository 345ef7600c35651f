//! ISO 230-2: accuracy and repeatability of positioning, in the words and symbols of its clause 3.

use super::Line;

/// What was found at one target position; in mm or rad like the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtTarget {
    /// The target (mm or deg).
    pub target: f64,
    /// Mean deviations x̄ᵢ↑ and x̄ᵢ↓.
    pub mean: [Option<f64>; 2],
    /// Estimators sᵢ↑ and sᵢ↓ of the standard uncertainty of a run, from two runs on.
    pub spread: [Option<f64>; 2],
    /// Reversal value Bᵢ = x̄ᵢ↑ − x̄ᵢ↓.
    pub reversal: Option<f64>,
    /// Repeatability Rᵢ↑ = 4sᵢ↑ and Rᵢ↓ = 4sᵢ↓.
    pub repeatability: [Option<f64>; 2],
    /// Rᵢ = max(2sᵢ↑ + 2sᵢ↓ + |Bᵢ|, Rᵢ↑, Rᵢ↓).
    pub both: Option<f64>,
}

/// The axis as a whole. Index 0 is ↑ (after positive travel), 1 is ↓.
#[derive(Clone, Debug, PartialEq)]
pub struct Analysis {
    /// The targets.
    pub targets: Vec<AtTarget>,
    /// Number of runs in each direction.
    pub runs: [usize; 2],
    /// Accuracy A↑, A↓: max(x̄ᵢ + 2sᵢ) − min(x̄ᵢ − 2sᵢ).
    pub accuracy: [Option<f64>; 2],
    /// The same of both directions: A.
    pub accuracy_both: Option<f64>,
    /// Systematic positional deviation E↑, E↓: range of x̄ᵢ.
    pub systematic: [Option<f64>; 2],
    /// The same of both directions: E.
    pub systematic_both: Option<f64>,
    /// Range M of the mean bidirectional deviations x̄ᵢ = (x̄ᵢ↑ + x̄ᵢ↓)/2.
    pub mean_range: Option<f64>,
    /// Reversal value B = max |Bᵢ|.
    pub reversal: Option<f64>,
    /// Mean reversal value B̄, with its sign.
    pub mean_reversal: Option<f64>,
    /// Repeatability R↑, R↓: the largest Rᵢ of the direction.
    pub repeatability: [Option<f64>; 2],
    /// The same of both directions: R.
    pub repeatability_both: Option<f64>,
}

/// Evaluates the runs of an axis.
#[must_use]
pub fn analysis(line: &Line) -> Analysis {
    const DIRECTIONS: [f64; 2] = [1.0, -1.0];
    let runs = |direction: f64| {
        line.columns
            .iter()
            .filter(move |c| c.direction == direction)
    };
    let targets: Vec<AtTarget> = (line.targets.iter().enumerate())
        .map(|(i, target)| {
            let values = |d| runs(d).map(move |c| c.readings[i]).collect::<Vec<f64>>();
            let mean = DIRECTIONS.map(|d| mean(&values(d)));
            let spread = DIRECTIONS.map(|d| spread(&values(d)));
            let reversal = mean[0].zip(mean[1]).map(|(up, down)| up - down);
            let repeatability = spread.map(|s| s.map(|s| 4.0 * s));
            let both = spread[0].zip(spread[1]).zip(reversal);
            let both = both.map(|((up, down), b)| {
                let together = 2.0 * up + 2.0 * down + b.abs();
                together.max(4.0 * up).max(4.0 * down)
            });
            AtTarget {
                target: *target,
                mean,
                spread,
                reversal,
                repeatability,
                both,
            }
        })
        .collect();
    // One of a direction, from two numbers of each target.
    let of = |f: &dyn Fn(&AtTarget, usize) -> Option<[f64; 2]>| {
        [0, 1].map(|d| {
            let ends: Option<Vec<[f64; 2]>> = targets.iter().map(|t| f(t, d)).collect();
            ends.and_then(|ends| hull(&ends))
        })
    };
    let uncertain = of(&|t, d| {
        let (x, s) = t.mean[d].zip(t.spread[d])?;
        Some([x - 2.0 * s, x + 2.0 * s])
    });
    let systematic = of(&|t, d| t.mean[d].map(|x| [x, x]));
    let means = |t: &AtTarget| {
        let (up, down) = t.mean[0].zip(t.mean[1])?;
        Some([0.5 * (up + down); 2])
    };
    let means: Option<Vec<[f64; 2]>> = targets.iter().map(means).collect();
    let size = |[low, high]: [f64; 2]| high - low;
    let together = |[up, down]: [Option<[f64; 2]>; 2]| {
        let (up, down) = up.zip(down)?;
        hull(&[up, down]).map(size)
    };
    let reversals: Option<Vec<f64>> = targets.iter().map(|t| t.reversal).collect();
    let largest = |values: Option<Vec<f64>>| values?.into_iter().reduce(f64::max);
    Analysis {
        runs: DIRECTIONS.map(|d| runs(d).count()),
        accuracy: uncertain.map(|ends| ends.map(size)),
        accuracy_both: together(uncertain),
        systematic: systematic.map(|ends| ends.map(size)),
        systematic_both: together(systematic),
        mean_range: means.and_then(|m| hull(&m)).map(size),
        reversal: largest((reversals.as_ref()).map(|all| all.iter().map(|b| b.abs()).collect())),
        mean_reversal: reversals.and_then(|all| mean(&all)),
        repeatability: [0, 1]
            .map(|d| largest(targets.iter().map(|t| t.repeatability[d]).collect())),
        repeatability_both: largest(targets.iter().map(|t| t.both).collect()),
        targets,
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Standard deviation with n − 1.
fn spread(values: &[f64]) -> Option<f64> {
    let mean = mean(values).filter(|_| values.len() > 1)?;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    Some((squares / (values.len() - 1) as f64).sqrt())
}

/// From the least to the largest.
fn hull(ends: &[[f64; 2]]) -> Option<[f64; 2]> {
    let all = ends.iter().copied();
    all.reduce(|[a, b], [low, high]| [a.min(low), b.max(high)])
}
