//! A position given on the command line: `X=0,A=30`.

use super::bad_input::BadInput;
use super::number::finite;
use trueaxis_model::machine::Machine;

/// Describes what is wrong with the value of a position option, with an example for this machine.
fn bad(option: &str, cause: String, machine: &Machine) -> BadInput {
    let axes = machine.axes.iter();
    let example: Vec<String> = axes.map(|a| format!("{}=0", a.letter)).collect();
    BadInput::new(
        format!("{option}: {cause}"),
        format!(
            "write a position within the travel in mm and degrees, like {}",
            example.join(",")
        ),
    )
}

/// Reads the position (mm, deg) of an option, inside the travel or not. Axes left out are at 0.
pub fn position(option: &str, text: &str, machine: &Machine) -> Result<Vec<f64>, BadInput> {
    position_or(option, text, machine, &vec![0.0; machine.axes.len()])
}

/// Reads a position in which axes left out take their position from `others`.
pub fn position_or(
    option: &str,
    text: &str,
    machine: &Machine,
    others: &[f64],
) -> Result<Vec<f64>, BadInput> {
    let bad = |cause: String| bad(option, cause, machine);
    let mut position: Vec<Option<f64>> = vec![None; machine.axes.len()];
    for part in text.split(',') {
        let Some((name, value)) = part.split_once('=') else {
            if part.trim().parse::<f64>().is_ok() {
                return Err(bad(format!(
                    "`{part}` has no axis: write a decimal point, not a comma"
                )));
            }
            return Err(bad(format!(
                "`{part}` is not an axis, an equals sign and a number"
            )));
        };
        let mut letters = name.trim().chars();
        let index = match (letters.next(), letters.next()) {
            (Some(letter), None) => machine.index(letter.to_ascii_uppercase()),
            _ => None,
        };
        let Some(index) = index else {
            return Err(bad(format!("the machine has no axis `{}`", name.trim())));
        };
        if position[index].is_some() {
            return Err(bad(format!("axis {} is given twice", name.trim())));
        }
        let value = value.trim();
        let number = finite(value).map_err(|_| bad(format!("`{value}` is not a finite number")))?;
        position[index] = Some(number);
    }
    Ok((position.into_iter().zip(others))
        .map(|(given, other)| given.unwrap_or(*other))
        .collect())
}

/// Reads the position of `--zero-at`, if it is given; it must be inside the travel.
pub fn zero_position(text: Option<&str>, machine: &Machine) -> Result<Option<Vec<f64>>, BadInput> {
    let position = text.map(|text| within_travel("--zero-at", text, machine));
    position.transpose()
}

/// Like `zero_position`, for any option.
pub fn within_travel(option: &str, text: &str, machine: &Machine) -> Result<Vec<f64>, BadInput> {
    let position = position(option, text, machine)?;
    for (axis, q) in machine.axes.iter().zip(&position) {
        let [low, high] = axis.travel;
        if *q < low || *q > high {
            let cause = format!(
                "{} = {q} is outside its travel {low} to {high} {}",
                axis.letter,
                axis.unit()
            );
            return Err(bad(option, cause, machine));
        }
    }
    Ok(position)
}
