//! Samples along variables are asked for again and again: each is made once.

use super::along::Column;
use super::sampling::{Component, Sampler};
use crate::kinematics::NotConverged;
use crate::machine::PerAxis;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Component, monomial, node, variable, and the bits of the position along it.
type Key = (usize, usize, usize, usize, u64);

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
        let key = |c: &Column, x: f64| (c.component, c.monomial, c.node, v, x.to_bits());
        let known = || self.memory.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut missing: Vec<(Key, &Column, f64)> = Vec::new();
        {
            let known = known();
            for x in at {
                for column in columns {
                    let key = key(column, *x);
                    if !known.contains_key(&key) {
                        missing.push((key, column, *x));
                    }
                }
            }
        }
        // Columns that differ in the output only share their exact corrections.
        missing.sort_unstable_by_key(|(key, _, _)| *key);
        missing.dedup_by_key(|(key, _, _)| *key);
        let made: Result<Vec<(Key, PerAxis)>, NotConverged> = missing
            .into_par_iter()
            .map(|(key, column, x)| {
                let value = self.coefficient_at(column, v, components, x)?;
                Ok((key, value))
            })
            .collect();
        let made = made?;
        let mut known = known();
        known.extend(made);
        Ok(at
            .iter()
            .map(|x| columns.iter().map(|c| known[&key(c, *x)]).collect())
            .collect())
    }

    /// One of them.
    fn coefficient_at(
        &self,
        column: &Column,
        v: usize,
        components: &[Component],
        x: f64,
    ) -> Result<PerAxis, NotConverged> {
        let component = &components[column.component];
        let mut place = component.place(column.node);
        let sides = self.variables[v].sides(x);
        let mut mean = PerAxis::default();
        for side in &sides {
            place[v] = *side;
            let value = self.coefficient(component, column.monomial, &place)?;
            for (m, x) in mean.iter_mut().zip(value) {
                *m += x / sides.len() as f64;
            }
        }
        Ok(mean)
    }
}
