//! Errors whose corrections of an output are proportional share the same tables.

use super::form::Form;
use super::sources::Source;
use crate::schemes::products::Function;
use trueaxis_model::machine::Machine;

/// Closed forms are proportional if they differ by less than this fraction.
const SAME: f64 = 1e-9;

/// Tables of one output and the errors that share them.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Index of the output axis.
    pub output: usize,
    /// The correction (mm or deg) for a weight of 1.
    pub form: Form,
    /// Further factors.
    pub along: Vec<Function>,
    /// The weight: the error itself if there is only one, or the sum of proportional ones.
    pub weight: f64,
    /// The errors, each with its contribution per unit to the weight.
    pub members: Vec<(usize, f64)>,
}

impl Group {
    /// The only error of the group, if its own value is the weight.
    pub fn alone(&self) -> Option<usize> {
        match self.members[..] {
            [(source, 1.0)] => Some(source),
            _ => None,
        }
    }
}

/// The groups of all outputs.
///
/// Corrections of linear axes contain levers, each with tables of the rotary axes; errors are grouped if they are
/// proportional in all of them. Corrections of rotary axes have no levers, so all errors except error motions are
/// summed. An error with an adjustable weight gets its own group.
pub fn groups(machine: &Machine, sources: &[Source], forms: &[Vec<Form>]) -> Vec<Group> {
    let mut groups = Vec::new();
    for (output, axis) in machine.axes.iter().enumerate() {
        let rotary = axis.letter.is_rotary();
        let mut of_output: Vec<Group> = Vec::new();
        for (number, source) in sources.iter().enumerate() {
            let form = Form(
                forms[number][output]
                    .0
                    .iter()
                    .map(|m| m * axis.to_command(1.0))
                    .collect(),
            );
            if form.0.iter().all(|m| m.amax() == 0.0) {
                continue;
            }
            let joins = |group: &Group| {
                let open = |(member, _): &(usize, f64)| !sources[*member].is_adjustable;
                !source.is_adjustable
                    && source.along == group.along
                    && group.members.iter().all(open)
            };
            let whole = rotary && source.along.is_empty();
            let joined = of_output.iter_mut().find_map(|group| match joins(group) {
                true if whole => Some((group, None)),
                true => times(&form, &group.form).map(|ratio| (group, Some(ratio))),
                false => None,
            });
            match joined {
                Some((group, Some(ratio))) => {
                    group.weight += ratio * source.value;
                    group.members.push((number, ratio));
                }
                Some((group, None)) => group.add(number, &form, source.value),
                None => of_output.push(Group {
                    output,
                    form,
                    along: source.along.clone(),
                    weight: source.value,
                    members: vec![(number, 1.0)],
                }),
            }
        }
        groups.extend(of_output);
    }
    let matters = |group: &Group| {
        let adjustable = |(member, _): &(usize, f64)| sources[*member].is_adjustable;
        group.weight != 0.0 || group.members.iter().any(adjustable)
    };
    groups.retain(matters);
    groups
}

impl Group {
    /// Adds an error to the tables instead of the weight.
    fn add(&mut self, number: usize, form: &Form, value: f64) {
        if self.alone().is_some() {
            for matrix in &mut self.form.0 {
                *matrix *= self.weight;
            }
            self.members[0].1 = self.weight;
            self.weight = 1.0;
        }
        for (sum, matrix) in self.form.0.iter_mut().zip(&form.0) {
            *sum += matrix * value;
        }
        self.members.push((number, value));
    }
}

/// The ratio of `b` to `a`, if they are proportional.
fn times(a: &Form, b: &Form) -> Option<f64> {
    let (a, b) = (a.flat(), b.flat());
    let ratio = a.dot(&b) / b.norm_squared();
    ((&a - &b * ratio).norm() <= SAME * a.norm()).then_some(ratio)
}
