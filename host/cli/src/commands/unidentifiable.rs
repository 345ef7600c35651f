//! Parameters that the probings cannot identify, and measurements that would identify them.

use trueaxis_measure::identify::{Unknown, Unseen, grouped};
use trueaxis_measure::plan::{Remedy, added};
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
