//! Location errors that a model lacks and cannot compensate for.

use crate::derivatives::largest;
use crate::locations::{ColumnSpan, in_order_of_preference};
use crate::structure::Ideal;
use crate::{Identified, IdentifyError, Model, Problem, Unknown};
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;

/// Do not print more names than fit on a command line.
const NAMES: usize = 40;

impl Problem<'_> {
    /// The smallest set of location errors that must be added so that the unknowns can, at these positions,
    /// reproduce the effect of all location errors on the tip. Known errors of the machine count as reproduced.
    ///
    /// # Errors
    /// [`IdentifyError`] if derivatives are not finite.
    pub fn missing(&self) -> Result<Vec<Parameter>, IdentifyError> {
        let Ideal {
            problem,
            estimate,
            weights,
        } = Ideal::new(self)?;
        let mut span = ColumnSpan::of(&problem.jacobian(&estimate, &weights));
        let is_other = |p: &Parameter| {
            !self.unknowns.contains(&Unknown::Parameter(*p))
                && !self.base.parameters.contains_key(p)
        };
        let mut others = in_order_of_preference(self.machine);
        others.retain(is_other);
        let unknowns: Vec<Unknown> = others.iter().map(|p| Unknown::Parameter(*p)).collect();
        let columns = problem.derivatives(&unknowns, &estimate, &weights);
        // Effects below the accuracy of probings, even at the upper limit for any machine, count as zero.
        let rows = (columns.nrows() as f64).sqrt();
        let adds = |(p, column): &(Parameter, nalgebra::DVector<f64>)| {
            span.add(column.clone(), rows / largest(*p))
        };
        let columns = columns.column_iter().map(|c| c.into_owned());
        Ok((others.into_iter().zip(columns))
            .filter(adds)
            .map(|(p, _)| p)
            .collect())
    }

    /// Location errors of which the stylus takes up the effect at these positions, because its place in the spindle is
    /// found together with the parameters: the smallest set. The tool that cuts does not take it up.
    ///
    /// # Errors
    /// [`IdentifyError`] if derivatives are not finite.
    pub(crate) fn hidden_by_stylus(
        &self,
        identified: &Identified,
    ) -> Result<Vec<Parameter>, IdentifyError> {
        let Ideal {
            problem,
            estimate,
            weights,
        } = Ideal::new(self)?;
        let jacobian = problem.jacobian(&estimate, &weights);
        // What was given up takes nothing up.
        let has = |p: &Parameter| identified.parameters.iter().any(|e| e.parameter == *p);
        let is_found = |i: &usize| match &problem.unknowns[*i] {
            Unknown::Parameter(parameter) => has(parameter),
            _ => true,
        };
        let is_stylus = |i: &usize| matches!(problem.unknowns[*i], Unknown::Stylus(_));
        let found: Vec<usize> = (0..problem.unknowns.len()).filter(is_found).collect();
        let with = ColumnSpan::of(&jacobian.select_columns(&found));
        let others: Vec<usize> = found.into_iter().filter(|i| !is_stylus(i)).collect();
        let mut without = ColumnSpan::of(&jacobian.select_columns(&others));
        let is_known = |p: &Parameter| identified.errors.parameters.contains_key(p);
        let mut candidates = in_order_of_preference(self.machine);
        candidates.retain(|p| !is_known(p));
        // The place of the spindle is that of the stylus itself: name what people look for first.
        candidates.sort_by_key(|p| p.axis == 'S');
        let unknowns: Vec<Unknown> = candidates.iter().map(|p| Unknown::Parameter(*p)).collect();
        let columns = problem.derivatives(&unknowns, &estimate, &weights);
        let rows = (columns.nrows() as f64).sqrt();
        let columns = columns.column_iter().map(|c| c.into_owned());
        let is_hidden = |(p, column): &(Parameter, nalgebra::DVector<f64>)| {
            let least = rows / largest(*p);
            !with.clone().add(column.clone(), least) && without.add(column.clone(), least)
        };
        Ok((candidates.into_iter().zip(columns))
            .filter(is_hidden)
            .map(|(p, _)| p)
            .collect())
    }
}

/// A note about them, with a model that includes them in addition to `looked_for`.
#[must_use]
pub fn lacks(machine: &Machine, looked_for: &[Parameter], missing: &[Parameter]) -> String {
    let all = [looked_for, missing].concat();
    let has_all = |model: &Model| {
        let parameters = model.parameters(machine, 0, &[]);
        parameters.is_ok_and(|has| all.iter().all(|p| has.contains(p)))
    };
    let known = [Model::Ten, Model::Twelve, Model::Thirteen]
        .into_iter()
        .find(has_all);
    let model = match known {
        Some(model) => model,
        None if all.len() <= NAMES => Model::Named(all.clone()),
        None => Model::Auto,
    };
    format!(
        "the model lacks {}: location errors that show at these positions, and that its parameters, balls and stylus cannot make up for; a machine that has them gets wrong values for others. Give --model {model}",
        Model::Named(missing.to_vec()),
    )
}
