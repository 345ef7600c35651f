//! Explains how the chosen model differs from the one published for machines of this layout.

use trueaxis_identify::{Missing, Published};

/// Why coefficients are missing, in words.
const REASONS: [(Missing, &str); 5] = [
    (
        Missing::Constant,
        "constants, which the location errors cover: ",
    ),
    (Missing::Confounded, "not distinguishable from those kept: "),
    (
        Missing::Idle,
        "that do nothing here, or of whose axis no row says from where it came: ",
    ),
    (Missing::Degree, "that predict other positions no better: "),
    (
        Missing::Form,
        "polynomials of endless axes, whose harmonics are kept: ",
    ),
];

/// A line for each reason.
pub fn published(text: &mut String, published: Option<&Published>) {
    let Some(published) = published else { return };
    *text += &format!(
        "\nbeside the {} coefficients published for machines laid out so (--model {}), ",
        published.count, published.model
    );
    match &published.fit {
        Ok(fit) => {
            *text += &format!(
                "{} of them seen here, with a residual of {:.2} µm\n",
                fit.parameters,
                fit.left * 1e3
            );
        }
        Err(error) => {
            *text += &format!("which cannot be identified here: {error}\n");
        }
    }
    let mut list = |count: usize, what: &str, names: Vec<String>| {
        if count > 0 {
            *text += &format!("{count:>5} {what}{}\n", names.join(", "));
        }
    };
    list(published.kept.len(), "kept here too", Vec::new());
    for (why, what) in REASONS {
        let names = published.missing.iter().filter(|(_, other)| *other == why);
        let names: Vec<String> = names.map(|(p, _)| p.to_string()).collect();
        list(names.len(), what, names);
    }
    let besides = published.besides.iter().map(ToString::to_string);
    list(published.besides.len(), "also kept: ", besides.collect());
    if published.is_same {
        *text += "  as many, with the same residual: the same errors in other coefficients\n";
    }
}
