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
        if let Some(ours) = at("trueaxis.read") {
            let reason = "feedback of the last period: it belongs before trueaxis.read";
            self.drives(thread, &functions[ours..], &READS, ("1", reason));
        }
        if let Some(ours) = at("trueaxis.write") {
            let reason = "commands of the last period: it belongs after trueaxis.write";
            self.drives(thread, &functions[..ours], &WRITES, ("-1", reason));
        }
    }

    /// Functions of drives among those where they do not belong; they belong at a place of the thread.
    fn drives(
        &mut self,
        thread: &str,
        functions: &[(String, HalCommand)],
        endings: &[&str],
        (place, reason): (&str, &str),
    ) {
        for (function, command) in functions {
            let counts = endings.iter().any(|e| function.ends_with(e));
            if counts && !function.starts_with("trueaxis") {
                self.warn(
                    &command.place.clone(),
                    format!("{function} in {thread} deals with {reason}"),
                    format!("addf {function} {thread} {place}"),
                );
            }
        }
    }

    /// The command that adds a function to any thread.
    fn elsewhere(&self, name: &str) -> Option<&HalCommand> {
        let all = self.configuration.hal.threads.values().flatten();
        Some(&all.into_iter().find(|(f, _)| f == name)?.1)
    }
}
