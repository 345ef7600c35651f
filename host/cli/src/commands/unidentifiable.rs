//! Parameters that the probings cannot identify, and measurements that would identify them.

use trueaxis_measure::formats::probings::Probing;
use trueaxis_measure::identify::{Unknown, Unseen, grouped};
use trueaxis_measure::plan::Remedy;
use trueaxis_model::errors::ParameterKind;
use trueaxis_model::machine::Machine;

/// A sentence for each remedy, with the probings that would identify parameters.
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
    for (sentence, group) in grouped(&unseen) {
        *text += &format!("  {sentence}\n");
        let mut places: Vec<(Option<String>, Vec<String>)> = Vec::new();
        for one in group.iter().map(|i| unseen[*i]) {
            let place = added(machine, balls, one.unknown, remedies);
            let is_backlash =
                matches!(one.unknown, Unknown::Parameter(p) if p.kind == ParameterKind::Backlash);
            if place.is_none() && (is_backlash || remedies.iter().all(|r| r.unseen != one.unknown))
            {
                continue;
            }
            let name = one.unknown.to_string();
            match places.iter_mut().find(|(other, _)| *other == place) {
                Some((_, names)) => names.push(name),
                None => places.push((place, vec![name])),
            }
        }
        for (place, names) in places {
            let who = match names.len() == group.len() {
                true => String::new(),
                false => format!(" (shows {})", names.join(", ")),
            };
            *text += &match place {
                Some(place) => format!("    add: {place}{who}\n"),
                None if who.is_empty() => {
                    "    no single probing of these balls shows it\n".to_owned()
                }
                None => format!(
                    "    no single probing of these balls shows {}\n",
                    names.join(", ")
                ),
            };
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
