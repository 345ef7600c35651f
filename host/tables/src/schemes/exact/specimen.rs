//! Machines and errors for the tests of the scheme's parts.

use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// A machine with linear axes in the tool branch and rotary ones in the workpiece branch (letter, travel), in this
/// order.
pub fn machine(axes: &[(char, [f64; 2])]) -> Machine {
    let mut text = String::from("name = \"specimen\"\n");
    for (letter, range) in axes {
        let rotary = "ABC".contains(*letter);
        let branch = if rotary { "workpiece" } else { "tool" };
        text += &format!(
            "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = {range:?}\n\
             origin_mm = [{0:?}, 0.0, {0:?}]\n",
            if rotary { 35.0 } else { 0.0 }
        );
    }
    text += "[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -120.0]\n";
    Machine::from_toml(&text).unwrap()
}

/// Three linear axes of ±200 mm and the given rotary axes.
pub(crate) fn with_rotary(rotary: &[(char, [f64; 2])]) -> Machine {
    let linear = ['X', 'Y', 'Z'].map(|letter| (letter, [-200.0, 200.0]));
    machine(&[&linear[..], rotary].concat())
}

/// Errors from the lines of an error file.
pub fn errors(machine: &Machine, lines: &str) -> ErrorModel {
    ErrorModel::from_toml(&format!("machine = \"specimen\"\n{lines}"), machine).unwrap()
}
