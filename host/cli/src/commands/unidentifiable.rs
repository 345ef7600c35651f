//! Parameters that the probings cannot identify, and measurements that would identify them.

use trueaxis_measure::formats::probings::Probing;
use trueaxis_measure::identify::{Unknown, Unseen};
use trueaxis_measure::plan::Remedy;
use trueaxis_model::errors::ParameterKind;
use trueaxis_model::machine::Machine;

/// A sentence for each parameter, with a probing that would identify it.
pub fn lines(
    text: &mut String,
    probed: &str,
    machine: &Machine,
    balls: &[String],
    unseen: &[Unseen],
    remedies: &[Remedy],
) {
    let is_parameter = |u: &&Unseen| matches!(u.unknown, Unknown::Parameter(_));
    let unseen: Vec<&Unseen> = unseen.iter().filter(is_parameter).collect();
    if unseen.is_empty() {
        return;
    }
    *text += &format!("\nnot to be seen {probed}\n");
    for one in unseen {
        *text += &format!("  {}\n", one.sentence());
        let is_backlash =
            matches!(one.unknown, Unknown::Parameter(p) if p.kind == ParameterKind::Backlash);
        if let Some(place) = added(machine, balls, one.unknown, remedies) {
            *text += &format!("    add: {place}\n");
        } else if !is_backlash && remedies.iter().any(|r| r.unseen == one.unknown) {
            *text += "    no single probing of these balls shows it\n";
        }
    }
}

/// The probing that would identify a parameter, as text.
pub fn added(
    machine: &Machine,
    balls: &[String],
    unseen: Unknown,
    remedies: &[Remedy],
) -> Option<String> {
    let remedy = remedies.iter().find(|r| r.unseen == unseen)?;
    Some(place(machine, balls, remedy.add.as_ref()?))
}

/// The place of a probing, as text.
fn place(machine: &Machine, balls: &[String], row: &Probing) -> String {
    let mut at = Vec::new();
    for (i, axis) in machine.axes.iter().enumerate() {
        if axis.letter.is_rotary() {
            let came = match row.direction[i] {
                d if d > 0.0 => " from below",
                d if d < 0.0 => " from above",
                _ => "",
            };
            at.push(format!("{} = {}{came}", axis.letter, row.position[i]));
        }
    }
    if row.spindle != 0.0 {
        at.push(format!("S = {}", row.spindle));
    }
    format!("ball {} at {}", balls[row.ball], at.join(", "))
}
