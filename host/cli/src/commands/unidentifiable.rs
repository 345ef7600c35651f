//! Parameters that the probings cannot identify, and measurements that would identify them.

use trueaxis_identify::{Unknown, Unseen, grouped};
use trueaxis_model::errors::ParameterKind;
use trueaxis_model::machine::Machine;
use trueaxis_probing::plan::{Remedy, added};

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
        let group: Vec<Unknown> = group.iter().map(|i| unseen[*i].unknown).collect();
        for (place, names) in places(machine, balls, &group, remedies) {
            let (is_all, names) = (names.len() == group.len(), names.join(", "));
            *text += &match place {
                Some(place) if is_all => format!("    add: {place}\n"),
                Some(place) => format!("    add: {place} (shows {names})\n"),
                None if is_all => "    no single probing of these balls shows it\n".to_owned(),
                None => format!("    no single probing of these balls shows {names}\n"),
            };
        }
    }
}

/// The probings to add, each with the names of what it shows; `None` if no single one does.
fn places(
    machine: &Machine,
    balls: &[String],
    group: &[Unknown],
    remedies: &[Remedy],
) -> Vec<(Option<String>, Vec<String>)> {
    let mut places: Vec<(Option<String>, Vec<String>)> = Vec::new();
    for one in group {
        let place = added(machine, balls, *one, remedies);
        let is_backlash = matches!(one, Unknown::Parameter(p) if p.kind == ParameterKind::Backlash);
        if place.is_none() && (is_backlash || remedies.iter().all(|r| r.unseen != *one)) {
            continue;
        }
        match places.iter_mut().find(|(other, _)| *other == place) {
            Some((_, names)) => names.push(one.to_string()),
            None => places.push((place, vec![one.to_string()])),
        }
    }
    places
}
