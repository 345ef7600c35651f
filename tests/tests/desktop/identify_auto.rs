//! The automatic choice, compared with the coefficients published for machines of the same layout.

use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::{Chosen, Level, Missing, RotationForm, TriedTerms, published};
use trueaxis_model::errors::ParameterKind;
use trueaxis_tests::probed::Case;

fn chosen(case: &Case) -> Chosen {
    case.chosen(&case.noisy(0), &Observations::default())
}

fn level(chosen: &Chosen) -> &Level {
    &chosen.levels[chosen.chosen]
}

#[test]
fn with_the_document_s_strategies_as_many_coefficients_are_kept_that_are_the_same_errors() {
    // Two of the Kolibri's are backlash, for which rows must state the approach direction of the axes.
    for (folder, errors, count) in [
        ("kolibri", "errors-81.toml", 81),
        ("hu40", "errors-84.toml", 84),
    ] {
        let case = Case::new(folder, errors).coming();
        let chosen = chosen(&case);
        assert_eq!(chosen.identified.parameters.len(), count);
        assert_eq!(
            level(&chosen).tried,
            TriedTerms::Degree(3, RotationForm::Polynomials)
        );
        let beside = published(&case.machine, &chosen).unwrap();
        // Alternatives among parameters that cannot be distinguished.
        assert!(beside.is_same, "{beside:?}");
        assert_eq!(beside.count, count);
        assert_eq!(beside.missing.len(), beside.besides.len());
        assert_eq!(beside.kept.len() + beside.missing.len(), count);
        for (parameter, why) in &beside.missing {
            let expected = match parameter.kind {
                ParameterKind::Degree(0) => Missing::Constant,
                _ => Missing::Confounded,
            };
            assert_eq!(*why, expected, "{parameter}");
        }
    }
}

#[test]
fn what_is_not_kept_has_its_reason() {
    // Ten errors, and rows that do not state the approach direction of the axes.
    let case = Case::new("kolibri", "errors-10.toml");
    let chosen = chosen(&case);
    assert_eq!((chosen.chosen, chosen.identified.parameters.len()), (0, 10));
    let beside = published(&case.machine, &chosen).unwrap();
    let count = |why: Missing| {
        let missing = beside.missing.iter();
        missing.filter(|(_, other)| *other == why).count()
    };
    // Of 81: seven constants, two backlashes, two scales; the rest are motions that this machine does not have.
    assert_eq!((count(Missing::Constant), count(Missing::Idle)), (7, 2));
    assert_eq!((count(Missing::Degree), beside.kept.len()), (70, 2));
    assert!(!beside.is_same);
}
