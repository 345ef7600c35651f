//! Generators: a few tables of a variable whose products give most of its functions.

use super::variables::{Kind, Variable};

/// A table from which functions are made as products.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Generator {
    /// [`Variable::coordinate`].
    Coordinate,
    /// [`Variable::sine`].
    Sine,
    /// [`Variable::cosine`].
    Cosine,
}

impl Generator {
    /// Value at a position of a variable.
    pub fn value(self, variable: &Variable, x: f64) -> f64 {
        match self {
            Self::Coordinate => variable.coordinate(x),
            Self::Sine => variable.sine(x),
            Self::Cosine => variable.cosine(x),
        }
    }
}

/// The products of generators up to a degree, with sine at most once because sin² = 1 − cos².
pub fn products(kind: &Kind, degree: usize) -> Vec<Vec<Generator>> {
    match kind {
        Kind::Rotary(_) => {
            let mut all = vec![vec![]];
            for d in 1..=degree {
                all.push(vec![Generator::Cosine; d]);
                let mut with_sine = vec![Generator::Sine];
                with_sine.extend(vec![Generator::Cosine; d - 1]);
                all.push(with_sine);
            }
            all
        }
        _ => (0..=degree)
            .map(|d| vec![Generator::Coordinate; d])
            .collect(),
    }
}
