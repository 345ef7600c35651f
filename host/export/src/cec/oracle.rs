//! An independent evaluation of a file, which shares no code with the tested modules.

use std::collections::HashMap;

/// A file as a map from names to assigned values.
pub struct AssignedValues(HashMap<String, String>);

/// The direction from which each axis has arrived: 1, −1, or 0 if unknown.
pub type Directions<'a> = &'a [i8];

impl AssignedValues {
    pub fn new(text: &str) -> Self {
        let lines = text
            .lines()
            .filter_map(|line| line.strip_prefix('$')?.split_once('='));
        Self(lines.map(|(a, b)| (a.to_owned(), b.to_owned())).collect())
    }

    fn number(&self, name: &str, table: usize) -> f64 {
        self.0[&format!("{name}[{table}]")].parse().unwrap()
    }

    fn tables(&self) -> usize {
        (0..)
            .find(|t| !self.0.contains_key(&format!("AN_CEC[{t},0]")))
            .unwrap()
    }

    fn value(&self, table: usize, position: f64, direction: i8) -> f64 {
        let own = self.number("AN_CEC_DIRECTION", table);
        if own != 0.0 && own != f64::from(direction) {
            return 0.0;
        }
        let [min, max, step] =
            ["MIN", "MAX", "STEP"].map(|n| self.number(&format!("AN_CEC_{n}"), table));
        let mut x = position - min;
        if self.number("AN_CEC_IS_MODULO", table) == 1.0 {
            x = x.rem_euclid(max - min);
        }
        let u = x.clamp(0.0, max - min) / step;
        let at =
            |k: f64| -> Option<f64> { self.0.get(&format!("AN_CEC[{table},{k}]"))?.parse().ok() };
        let below = at(u.floor()).unwrap();
        let weight = self.0.get(&format!("SN_CEC_TABLE_WEIGHT[{table}]"));
        let weight: f64 = weight.map_or(1.0, |w| w.parse().unwrap());
        weight * (below + (at(u.floor() + 1.0).unwrap_or(below) - below) * u.fract())
    }

    /// The correction of a named axis, at positions of named axes.
    pub fn correction(
        &self,
        output: &str,
        names: &[&str],
        q: &[f64],
        travel: Directions<'_>,
        added: bool,
    ) -> f64 {
        let value = |table: usize| {
            let input = &self.0[&format!("AN_CEC_INPUT_AXIS[{table}]")];
            let axis = names.iter().position(|n| n == input).unwrap();
            self.value(table, q[axis], travel[axis])
        };
        let times = |table: usize| self.number("AN_CEC_MULT_BY_TABLE", table) as usize;
        let count = self.tables();
        let mut sum = 0.0;
        for table in 0..count {
            if self.0[&format!("AN_CEC_OUTPUT_AXIS[{table}]")] != output {
                continue;
            }
            let is_factor = (0..count).any(|other| times(other) == table + 1);
            sum += match times(table) {
                0 if is_factor && !added => 0.0,
                0 => value(table),
                number => value(table) * value(number - 1),
            };
        }
        sum
    }
}
