//! Checks the order of the functions of the servo thread.

use super::CheckState;
use crate::formats::hal::HalCommand;

const CONTROLLER: &str = "motion-controller";
const HANDLER: &str = "motion-command-handler";

/// Suffixes of functions that read feedback of drives, and of those that write commands to drives.
const READS: [&str; 2] = [".read", ".capture-position"];
const WRITES: [&str; 3] = [".write", ".update-freq", ".do-pid-calcs"];

impl CheckState<'_> {
    /// Expects `trueaxis.read` before the motion controller, `trueaxis.write` after it, and the drives outside of
    /// both.
    pub(super) fn functions(&mut self) {
        let configuration = self.configuration;
        let loaded = self.component.map(|c| c.place.clone());
        let loaded = loaded.unwrap_or_else(|| configuration.start.clone());
        let mut threads = configuration.hal.threads.iter();
        let Some((thread, functions)) =
            threads.find(|(_, functions)| functions.iter().any(|(f, _)| f == CONTROLLER))
        else {
            self.refuse(
                &loaded,
                format!("{CONTROLLER} is in no thread"),
                format!("addf {CONTROLLER} servo-thread"),
            );
            return;
        };
        let at = |name: &str| functions.iter().position(|(f, _)| f == name);
        let controller = at(CONTROLLER).unwrap_or(0);
        let begin = at(HANDLER).map_or(controller, |handler| handler.min(controller));
        // Positions count from 1, in a thread with all other functions.
        let add_read = format!("addf trueaxis.read {thread} {}", begin + 1);
        let others = |until: usize| {
            let before = functions[..until].iter();
            before.filter(|(f, _)| !f.starts_with("trueaxis.")).count()
        };
        // After the controller, counting trueaxis.read before it.
        let add_write = format!("addf trueaxis.write {thread} {}", others(controller) + 3);
        for (name, right, side, write) in [
            (
                "trueaxis.read",
                at("trueaxis.read").map(|k| k < controller),
                "before",
                add_read,
            ),
            (
                "trueaxis.write",
                at("trueaxis.write").map(|k| k > controller),
                "after",
                add_write,
            ),
        ] {
            match right {
                Some(true) => {}
                Some(false) => {
                    let place = functions[at(name).unwrap_or(0)].1.place.clone();
                    self.refuse(
                        &place,
                        format!("{name} must stand {side} {CONTROLLER} in {thread}"),
                        write,
                    );
                }
                None => {
                    let elsewhere = self.elsewhere(name).map(|c| c.place.clone());
                    let place = elsewhere.unwrap_or_else(|| loaded.clone());
                    self.refuse(
                        &place,
                        format!("{name} is not in {thread}, where {CONTROLLER} is"),
                        write,
                    );
                }
            }
        }
        let around = [
            (
                "trueaxis.read",
                &READS[..],
                true,
                "feedback of the last period: it belongs before trueaxis.read",
            ),
            (
                "trueaxis.write",
                &WRITES[..],
                false,
                "commands of the last period: it belongs after trueaxis.write",
            ),
        ];
        for (ours, endings, before, reason) in around {
            let Some(our) = at(ours) else { continue };
            for (k, (function, command)) in functions.iter().enumerate() {
                let counts = endings.iter().any(|e| function.ends_with(e));
                if counts && !function.starts_with("trueaxis") && (k < our) != before {
                    self.warn(
                        &command.place.clone(),
                        format!("{function} in {thread} deals with {reason}"),
                        match before {
                            true => format!("addf {function} {thread} 1"),
                            false => format!("addf {function} {thread} -1"),
                        },
                    );
                }
            }
        }
    }

    /// The command that adds a function to any thread.
    fn elsewhere(&self, name: &str) -> Option<&HalCommand> {
        let all = self.configuration.hal.threads.values().flatten();
        Some(&all.into_iter().find(|(f, _)| f == name)?.1)
    }
}
