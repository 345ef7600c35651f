//! Which errors have adjustable weights, and within which limits.

use super::groups::Group;
use super::sources::Source;
use crate::schemes::SchemeError;

/// An adjustable weight may be set between zero and this many times its value.
const MOST_WEIGHT: f64 = 2.0;
/// Limit for the weight of an error whose value is zero, if requested: mm, and rad or mm per mm.
const FROM_NOTHING: [f64; 2] = [0.05, 2e-4];

/// For each group, the error that its weight represents, if that is adjustable.
pub fn adjustable(
    sources: &[Source],
    groups: &[Group],
    chains: &dyn Fn(usize) -> usize,
) -> Result<Vec<Option<usize>>, SchemeError> {
    let of = |source: usize| {
        let numbered = groups.iter().enumerate();
        numbered.filter(move |(_, g)| g.members.iter().any(|(member, _)| *member == source))
    };
    let terms = |source: usize| of(source).map(|(k, _)| chains(k)).sum::<usize>();
    let asked: Vec<usize> = (0..sources.len())
        .filter(|s| sources[*s].is_adjustable)
        .collect();
    let needed = asked.iter().map(|s| terms(*s)).sum::<usize>();
    if needed > trueaxis::ADJUSTABLE {
        return Err(SchemeError::TooManyWeights {
            needed,
            held: trueaxis::ADJUSTABLE,
        });
    }
    let open = |group: &Group| group.alone().filter(|source| asked.contains(source));
    Ok(groups.iter().map(open).collect())
}

/// The limits of an error's weight.
pub fn limits(source: &Source) -> [f32; 2] {
    let most = match source.value {
        0.0 => {
            let length = source.along.is_empty() && !source.unit.is_angular();
            FROM_NOTHING[usize::from(!length)]
        }
        value => (MOST_WEIGHT - 1.0) * value.abs(),
    };
    [source.value - most, source.value + most].map(|limit| limit as f32)
}
