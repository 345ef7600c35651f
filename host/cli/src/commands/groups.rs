//! The groups of commands in `trueaxis --help` and in the manual.

use super::Command;
use clap::Subcommand;
use std::fmt::Write;

/// Each group and the names of its commands, in the order of `Command`.
pub const GROUPS: [(&str, &[&str]); 7] = [
    ("Describe", &["new", "pose", "explain"]),
    (
        "Measure",
        &[
            "plan", "probings", "qualify", "identify", "measured", "skew",
        ],
    ),
    (
        "Compensate",
        &[
            "compile", "verify", "report", "inspect", "eval", "correct", "schemes", "generate",
        ],
    ),
    (
        "On a machine",
        &[
            "linuxcnc",
            "gcode",
            "export",
            "import",
            "flash",
            "control",
            "monitor",
            "calibrate",
        ],
    ),
    (
        "ISO tests",
        &["ballbar", "iso230-2", "iso230-3", "iso230-7"],
    ),
    ("Simulate", &["simulate"]),
    ("Shell", &["completions", "man"]),
];

/// The template of `trueaxis --help`. clap lists all subcommands under one heading, so it contains the groups.
pub fn help_template() -> String {
    let commands = Command::augment_subcommands(clap::Command::new("trueaxis"));
    let styles = commands.get_styles();
    let (heading, literal) = (styles.get_header(), styles.get_literal());
    let mut list = String::new();
    for (group, names) in GROUPS {
        let _ = writeln!(list, "\n{heading}{group}:{heading:#}");
        for name in names {
            let about = commands.find_subcommand(name).and_then(|c| c.get_about());
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(list, "  {literal}{name:<11}{literal:#}  {about}");
        }
    }
    format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{list}\n{heading}Options:{heading:#}\n{{options}}"
    )
}

#[cfg(test)]
mod tests {
    use super::GROUPS;
    use crate::commands::Cli;
    use clap::{Command, CommandFactory};

    #[test]
    fn each_command_is_in_exactly_one_group_and_in_the_help() {
        let command = Cli::command();
        let commands: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
        let grouped = GROUPS.iter().flat_map(|(_, names)| names.iter().copied());
        assert_eq!(
            grouped.collect::<Vec<_>>(),
            commands,
            "in the order of the enum"
        );
        let help = command.clone().render_help().to_string();
        for inner in command.get_subcommands() {
            let line = format!(
                "  {:<11}  {}\n",
                inner.get_name(),
                inner.get_about().unwrap()
            );
            assert_eq!(help.matches(&line).count(), 1, "{line}{help}");
        }
        for (group, _) in GROUPS {
            assert!(help.contains(&format!("\n\n{group}:\n")), "{help}");
        }
    }
}
