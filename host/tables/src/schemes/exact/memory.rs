//! Samples along variables are asked for again and again: each is made once.

use super::along::Column;
use super::sampling::{Component, Sampler};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;

/// Component, node, variable, and the bits of the position along it.
type Place = (usize, usize, usize, u64);

/// A place, and a monomial.
type Key = (Place, usize);

/// What has been sampled so far.
#[derive(Debug, Default)]
pub struct Memory(Mutex<HashMap<Key, PerAxis>>);

impl Sampler<'_> {
    /// The coefficients (mm, rad, all outputs) that columns stand for, at positions along variable
    /// `v`: positions × columns.
    pub fn along(
        &self,
        columns: &[Column],
        v: usize,
        components: &[Component],
        at: &[f64],
    ) -> Result<Vec<Vec<PerAxis>>, NotConverged> {
        let key = |c: &Column, x: f64| ((c.component, c.node, v, x.to_bits()), c.monomial);
        let known = || self.memory.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut missing: Vec<Key> = Vec::new();
        {
            let known = known();
            for x in at {
                for column in columns {
                    let key = key(column, *x);
                    if !known.contains_key(&key) {
                        missing.push(key);
                    }
                }
            }
        }
        // Columns that differ in the output only share their exact corrections; those that differ in the
        // monomial, most of them.
        missing.sort_unstable();
        missing.dedup();
        let places: Vec<&[Key]> = missing.chunk_by(|a, b| a.0 == b.0).collect();
        let made: Result<Vec<Vec<(Key, PerAxis)>>, NotConverged> = places
            .into_par_iter()
            .map(|keys| {
                let values = self.coefficients_at(keys, components)?;
                Ok(keys.iter().copied().zip(values).collect())
            })
            .collect();
        let made = made?.into_iter().flatten();
        let mut known = known();
        known.extend(made);
        Ok(at
            .iter()
            .map(|x| columns.iter().map(|c| known[&key(c, *x)]).collect())
            .collect())
    }

    /// Those of one place.
    fn coefficients_at(
        &self,
        keys: &[Key],
        components: &[Component],
    ) -> Result<Vec<PerAxis>, NotConverged> {
        let mut means = vec![PerAxis::default(); keys.len()];
        let Some(&((component, node, v, x), _)) = keys.first() else {
            return Ok(means);
        };
        let component = &components[component];
        let monomials: Vec<usize> = keys.iter().map(|key| key.1).collect();
        let mut place = component.place(node);
        let sides = self.variables[v].sides(f64::from_bits(x));
        for side in &sides {
            place[v] = *side;
            let values = self.coefficients(component, &monomials, &place)?;
            for (mean, value) in means.iter_mut().zip(values) {
                for (m, x) in mean.iter_mut().zip(value) {
                    *m += x / sides.len() as f64;
                }
            }
        }
        Ok(means)
    }
}
