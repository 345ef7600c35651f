//! Named figures: read from the measuring program, stored as flat JSON.

use crate::qemu;
use programs::process::said;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// Numbers by their keys.
#[derive(Default)]
pub struct Figures(BTreeMap<String, u64>);

impl Figures {
    /// Parses lines `key number`.
    ///
    /// # Errors
    /// If a line has another form: it is the program's error message.
    pub fn from_lines(text: &str) -> Result<Self, String> {
        let mut figures = Self::default();
        for line in text.lines() {
            let read = line
                .split_once(' ')
                .and_then(|(key, value)| Some((key, value.parse().ok()?)));
            match read {
                Some((key, value)) => figures.set(key, value),
                None => return Err(format!("the program on the target says: {line}")),
            }
        }
        Ok(figures)
    }

    /// Figures of a counting program, run in QEMU.
    ///
    /// # Errors
    /// If QEMU does not start, or the program does not finish.
    pub fn counted(program: &Path) -> Result<Self, String> {
        let said = said(&mut qemu::board(program))?;
        let figures = Self::from_lines(&said.output)?;
        if !said.status.success() || figures.get("done") != Some(1) {
            let errors = said.errors;
            return Err(format!("the measurement did not come to its end: {errors}"));
        }
        Ok(figures)
    }

    /// Parses the output of [`Figures::to_json`]; other lines are ignored.
    pub fn from_json(text: &str) -> Self {
        let entry = |line: &str| {
            let (key, value) = line.split_once(':')?;
            let value = value.trim().trim_end_matches(',').parse().ok()?;
            Some((key.trim().trim_matches('"').to_owned(), value))
        };
        Self(text.lines().filter_map(entry).collect())
    }

    /// All figures as JSON, one to a line.
    pub fn to_json(&self) -> String {
        let mut text = String::from("{\n");
        for (place, (key, value)) in self.0.iter().enumerate() {
            let comma = if place + 1 < self.0.len() { "," } else { "" };
            let _ = writeln!(text, "  \"{key}\": {value}{comma}");
        }
        text + "}\n"
    }

    /// Sets a figure.
    pub fn set(&mut self, key: &str, value: u64) {
        self.0.insert(key.to_owned(), value);
    }

    /// A figure, if there is one with this key.
    pub fn get(&self, key: &str) -> Option<u64> {
        self.0.get(key).copied()
    }

    /// One line for each of our figures that grew by more than `percent` over `before`, excluding rivals, and for each
    /// new or missing one.
    pub fn grown(&self, before: &Self, percent: u64) -> Vec<String> {
        let mut lines = Vec::new();
        for (key, &value) in &self.0 {
            match before.get(key) {
                None => lines.push(format!("{key} is new: {value}")),
                Some(old) if value * 100 > old * (100 + percent) && !key.starts_with("rival_") => {
                    lines.push(format!("{key} grew from {old} to {value}"));
                }
                Some(_) => {}
            }
        }
        let gone = before.0.keys().filter(|key| self.get(key).is_none());
        lines.extend(gone.map(|key| format!("{key} is no longer measured")));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::Figures;

    #[test]
    fn figures_survive_their_file() {
        let figures = Figures::from_lines("evaluate 400\nstack_evaluate 624").unwrap();
        let read = Figures::from_json(&figures.to_json());
        assert_eq!(figures.to_json(), read.to_json());
        assert_eq!(read.get("stack_evaluate"), Some(624));
    }

    #[test]
    fn what_the_target_complains_about_is_shown() {
        let error = Figures::from_lines("evaluate 400\nfailed load: no magic").err();
        assert!(error.is_some_and(|e| e.contains("failed load: no magic")));
    }

    #[test]
    fn growth_is_found_but_not_that_of_rivals() {
        let before = Figures::from_lines("a 100\nb 100\nrival_c 100\nold 1").unwrap();
        let now = Figures::from_lines("a 105\nb 106\nrival_c 200\nnew 1").unwrap();
        let lines = now.grown(&before, 5);
        assert_eq!(
            lines,
            [
                "b grew from 100 to 106",
                "new is new: 1",
                "old is no longer measured"
            ]
        );
    }
}
