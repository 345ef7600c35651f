//! Location errors that a model does not have, and that nothing in it makes up for.

use super::derivatives::largest;
use super::locations::{Span, in_order_of_preference};
use super::structure::Ideal;
use super::{IdentifyError, Model, Problem, Unknown};
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;

/// More names than this are no line of a command.
const NAMES: usize = 40;

impl Problem<'_> {
    /// The fewest location errors without which the unknowns cannot make up, at these positions, for what all of them
    /// together can do to the tip. What is known of the machine counts as made up for.
    ///
    /// # Errors
    /// [`IdentifyError`]: derivatives that are not finite numbers.
    pub fn missing(&self) -> Result<Vec<Parameter>, IdentifyError> {
        let Ideal {
            problem,
            estimate,
            weights,
        } = Ideal::new(self)?;
        let mut span = Span::of(&problem.jacobian(&estimate, &weights));
        let is_other = |p: &Parameter| {
            !self.unknowns.contains(&Unknown::Parameter(*p))
                && !self.base.parameters.contains_key(p)
        };
        let mut others = in_order_of_preference(self.machine);
        others.retain(is_other);
        let unknowns: Vec<Unknown> = others.iter().map(|p| Unknown::Parameter(*p)).collect();
        let columns = problem.derivatives(&unknowns, &estimate, &weights);
        // What is smaller than the accuracy of probings, were the error as large as in no machine, is nothing.
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
}

/// What to say of them, and the model that has them besides what was looked for.
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
