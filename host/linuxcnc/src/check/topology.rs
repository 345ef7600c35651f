//! Checks the kinematics module against the machine.

use super::CheckState;
use crate::kinematics::ModuleShape;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::{Branch, Machine};

/// Permitted distance (mm) of a rotary axis from its location in the module.
const APART: f64 = 1e-3;

/// Least component of a direction along its axis; oblique axes are not judged.
const ALONG: f64 = 0.9;

/// What makes an axis count the other way.
fn other_way(machine: &Machine, index: usize) -> String {
    let axis = &machine.axes[index];
    format!(
        "reversed = {} for {} in the machine file, then compile again",
        !axis.reversed, axis.letter
    )
}

impl CheckState<'_> {
    pub(super) fn topology(&mut self) {
        let module = self.configuration.module.clone();
        let letters = self.letters();
        let rotary_of =
            |text: &str| -> String { text.chars().filter(|l| "ABC".contains(*l)).collect() };
        let rotary = rotary_of(&letters);
        if !self.is_made_for_machine(&letters) {
            return;
        }
        self.linear();
        // Other modules are refused before.
        let Some(shape) = ModuleShape::of(&module.name) else {
            return;
        };
        let expected = rotary_of(shape.letters);
        if rotary.len() != expected.len() || !expected.chars().all(|l| rotary.contains(l)) {
            self.refuse(
                &module.place,
                format!("{} is for rotary axes {expected}, the compensation has {}", module.name, if rotary.is_empty() { "none" } else { &rotary }),
                "KINEMATICS = the module of this machine, or compile for the machine of this module".to_owned(),
            );
            return;
        }
        let Some(machine) = self.against.machine else {
            return;
        };
        let found = [Branch::Workpiece, Branch::Tool].map(|b| ModuleShape::rotary(machine, b));
        if found != [shape.workpiece, shape.tool].map(|letters| Some(letters.to_owned())) {
            self.refuse(
                &module.place,
                format!("{} is for {}, but the machine is {}", module.name, shape.words(), machine.topology()),
                "KINEMATICS = the module of this machine, or correct the machine file and compile again".to_owned(),
            );
            return;
        }
        self.rotary(machine, shape);
        if !shape.workpiece.is_empty() {
            self.offsets(machine, shape);
        }
    }

    /// False if the machine file is of another machine than the compensation, whose axes are `letters`.
    fn is_made_for_machine(&mut self, letters: &str) -> bool {
        let Some(machine) = self.against.machine else {
            return true;
        };
        let of_machine: String = machine.axes.iter().map(|a| a.letter.char()).collect();
        let compiled = self.against.runtime.compensation().machine();
        if machine.name == compiled && of_machine == letters {
            return true;
        }
        self.refuse(
            &self.configuration.module.place.clone(),
            format!("the compensation was made for the machine `{compiled}` with axes {letters}, the machine file describes `{}` with axes {of_machine}", machine.name),
            "--machine with the file from which the compensation was made".to_owned(),
        );
        false
    }

    /// Linear axes whose positive command moves the tool the negative way: LinuxCNC counts what the tool does.
    fn linear(&mut self) {
        let Some(machine) = self.against.machine else {
            return;
        };
        let perfect = ErrorModel::perfect(machine);
        let bench = Bench::new(machine, &perfect, Default::default());
        let home = bench.home();
        for index in bench.linear() {
            let letter = machine.axes[index].letter;
            if bench.way(&home, index)[letter.component() % 3] < -ALONG {
                let place = self.configuration.module.place.clone();
                self.warn(
                    &place,
                    format!("in the machine file a positive command of {letter} moves the tool in −{letter}, seen from the workpiece; LinuxCNC counts it in +{letter}"),
                    other_way(machine, index),
                );
            }
        }
    }

    /// Rotary axes that turn the other way in the module. With the same order, directions and locations, the poses are
    /// the same at every position.
    fn rotary(&mut self, machine: &Machine, shape: ModuleShape) {
        let module = &self.configuration.module;
        let conventional = format!("{}.conventional-directions", module.name);
        let conventional = self.configuration.hal.value(&conventional);
        let is_conventional = conventional.is_some_and(|(value, _)| value != 0.0);
        let place = module.place.clone();
        let name = module.name.clone();
        let perfect = ErrorModel::perfect(machine);
        let bench = Bench::new(machine, &perfect, Default::default());
        let home = bench.home();
        for index in bench.rotary() {
            let letter = machine.axes[index].letter;
            // By default it is the table that turns by +A; a head's B turns against the right hand.
            let expected = match shape.turns(letter.char()) {
                _ if shape.workpiece.contains(letter.char()) && is_conventional => 1.0,
                turns => turns,
            };
            let shown = bench.about(&home, index)[letter.component() % 3];
            if shown * expected < -ALONG {
                self.refuse(
                    &place,
                    format!("{letter} has the wrong sign in the machine file: {name} turns it the other way"),
                    other_way(machine, index),
                );
            }
        }
    }

    /// Locations of the rotary axes of a table, as set on pins of the module.
    fn offsets(&mut self, machine: &Machine, shape: ModuleShape) {
        let (hal, module) = (&self.configuration.hal, &self.configuration.module);
        let mm = self.configuration.mm.unwrap_or(1.0);
        let pin = |name: &str| format!("{}.{name}", module.name);
        // Values from connected pins are not known here; a pin that is not set is 0.
        let value = |name: &str| match hal.value(&pin(name)) {
            Some((value, _)) => Some(value * mm),
            None => hal.signal(&pin(name)).is_none().then_some(0.0),
        };
        let place = |name: &str| {
            hal.value(&pin(name))
                .map_or(module.place.clone(), |(_, c)| c.place.clone())
        };
        let origin = |letter: char| {
            let index = machine.index(letter)?;
            let t = machine.axes[index].frame.t;
            Some([t.x, t.y, t.z])
        };
        let cradle = shape.workpiece.chars().next().unwrap_or(' ');
        let (Some(table), Some(cradle_at)) = (origin('C'), origin(cradle)) else {
            return;
        };
        let points = ["x-rot-point", "y-rot-point", "z-rot-point"];
        let mut wrong = Vec::new();
        for i in 0..2 {
            if let Some(is) = value(points[i])
                && (is - table[i]).abs() > APART
            {
                wrong.push((points[i], 'C', is, table[i], table[i] / mm));
            }
        }
        // The height of the table is not part of its axis; the height of the cradle is measured from the point.
        for (i, offset) in shape.offsets {
            if let Some((from, offset_is)) = value(points[i]).zip(value(offset))
                && (from + offset_is - cradle_at[i]).abs() > APART
                && !wrong.iter().any(|w| w.0 == points[i])
            {
                let write = (cradle_at[i] - from) / mm;
                wrong.push((offset, cradle, from + offset_is, cradle_at[i], write));
            }
        }
        for (name, axis, is, expected, write) in wrong {
            let direction = ["x", "y", "z"]
                .iter()
                .find(|d| name.starts_with(**d))
                .unwrap_or(&"");
            let reason = format!(
                "{} puts the axis {axis} at {direction} = {is} mm, the machine file at {expected} mm",
                pin(name)
            );
            let write = format!("setp {} {}", pin(name), (write * 1e4).round() / 1e4);
            self.refuse(&place(name), reason, write);
        }
    }
}
