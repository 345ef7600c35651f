//! `docs/src/commands.md` lists every command and option. `UPDATE_COMMANDS=1` rewrites the list; review the diff.

use super::Cli;
use super::groups::GROUPS;
use clap::{Arg, ArgAction, Command, CommandFactory};
use std::fmt::Write;

/// Everything below this line of the page is the list.
const MARK: &str = "<!-- From here on: UPDATE_COMMANDS=1 cargo test -p trueaxis-cli --bin trueaxis reference -->\n";

/// The page of the manual that explains a command.
const PAGES: [(&str, &str); 47] = [
    ("pose", "machine-file"),
    ("explain", "measurement"),
    ("plan", "planning"),
    ("probings", "identification"),
    ("qualify", "probe"),
    ("identify", "identification"),
    ("measured", "direct-measurements"),
    ("skew", "printers"),
    ("compile", "compile-output"),
    ("verify", "figures"),
    ("report", "report"),
    ("inspect", "compile-output"),
    ("eval", "compile-output"),
    ("correct", "policies"),
    ("schemes", "schemes"),
    ("generate", "generate"),
    ("linuxcnc", "linuxcnc"),
    ("linuxcnc setup", "linuxcnc-check"),
    ("linuxcnc check", "linuxcnc-check"),
    ("linuxcnc model", "linuxcnc-simulated"),
    ("linuxcnc probe", "linuxcnc-calibrate"),
    ("linuxcnc calibrate", "linuxcnc-calibrate"),
    ("gcode", "gcode"),
    ("export cec", "sinumerik"),
    ("export fanuc", "controls"),
    ("export heidenhain", "controls"),
    ("export isg", "controls"),
    ("export linuxcnc", "linuxcnc-comp-file"),
    ("export klipper", "printers"),
    ("export klipper-twist", "printers"),
    ("export marlin", "printers"),
    ("export reprapfirmware", "printers"),
    ("import cec", "sinumerik"),
    ("import isg", "controls"),
    ("import klipper", "printers"),
    ("import klipper-twist", "printers"),
    ("import reprapfirmware", "printers"),
    ("import points", "linuxcnc"),
    ("flash", "board"),
    ("control", "board"),
    ("monitor", "link"),
    ("calibrate", "linuxcnc-calibrate"),
    ("ballbar", "ballbar"),
    ("iso230-2", "direct-measurements"),
    ("iso230-3", "thermal-drift"),
    ("iso230-7", "spindle-error-motion"),
    ("simulate controller", "board"),
];

/// A page of the manual.
fn path(name: &str) -> String {
    format!("{}/../../docs/src/{name}.md", env!("CARGO_MANIFEST_DIR"))
}

/// An argument as in a synopsis, marked as `--help` marks it.
fn written(argument: &Arg) -> String {
    let optional = !argument.is_required_set();
    let names = argument.get_value_names().unwrap_or_default();
    let mut values: Vec<String> = names.iter().map(ToString::to_string).collect();
    let words = argument.get_possible_values();
    if !words.is_empty() && !argument.is_hide_possible_values_set() {
        let words: Vec<&str> = words.iter().map(|word| word.get_name()).collect();
        values = vec![words.join("|")];
    }
    let most = argument
        .get_num_args()
        .map_or(1, |range| range.max_values());
    let repeated = matches!(argument.get_action(), ArgAction::Append)
        && argument.get_value_delimiter().is_none()
        && most == 1;
    let dots = if repeated || most > values.len().max(1) {
        "..."
    } else {
        ""
    };
    let name = match (argument.get_short(), argument.get_long()) {
        (Some(short), _) => format!("-{short}"),
        (None, Some(long)) => format!("--{long}"),
        (None, None) if optional => return format!("[{}]{dots}", values.join(" ")),
        (None, None) => return format!("<{}>{dots}", values.join("> <")),
    };
    let option = if argument.get_action().takes_values() {
        format!("{name} <{}>{dots}", values.join("> <"))
    } else {
        name
    };
    if optional {
        format!("[{option}]")
    } else {
        option
    }
}

/// The arguments of a command that it does not have from its parent: positional ones, required options, other options.
fn arguments(command: &Command, nested: bool) -> Vec<String> {
    let mut arguments: Vec<&Arg> = command
        .get_arguments()
        .filter(|argument| !argument.is_hide_set())
        .filter(|argument| !["help", "version"].contains(&argument.get_id().as_str()))
        .filter(|argument| !(nested && argument.is_global_set()))
        .collect();
    arguments.sort_by_key(|argument| (!argument.is_positional(), !argument.is_required_set()));
    arguments.into_iter().map(written).collect()
}

/// The sentence that names the page of the manual for a command.
fn page_link(name: &str) -> Option<String> {
    let (_, page) = PAGES.iter().find(|(command, _)| *command == name)?;
    let whole = std::fs::read_to_string(path(page)).unwrap();
    let title = whole.lines().next().unwrap().trim_start_matches("# ");
    Some(format!(" See [{title}]({page}.md)."))
}

/// Appends a command and those below it. `words` call it, `level` is the depth of its heading.
fn list(text: &mut String, command: &Command, words: &str, level: usize) {
    let name = words.replace(" …", "");
    let name = name.trim_start_matches("trueaxis ");
    let about = command.get_about().map(ToString::to_string);
    let _ = writeln!(
        text,
        "\n{} `{name}`\n\n{}.{}",
        "#".repeat(level),
        about.unwrap_or_default(),
        page_link(name).unwrap_or_default()
    );
    let inner: Vec<&Command> = command
        .get_subcommands()
        .filter(|inner| inner.get_name() != "help")
        .collect();
    let mut synopsis = arguments(command, level > 3);
    let own = !synopsis.is_empty();
    if inner.is_empty() || own {
        if !inner.is_empty() {
            synopsis.push("<COMMAND>".to_owned());
        }
        let mut lines = vec![words.to_owned()];
        for argument in synopsis {
            let line = lines.last_mut().unwrap();
            if line.chars().count() + argument.chars().count() < 110 {
                *line += &format!(" {argument}");
            } else {
                lines.push(format!("    {argument}"));
            }
        }
        let _ = writeln!(text, "\n```text\n{}\n```", lines.join("\n"));
    }
    let gap = if own { " …" } else { "" };
    for inner in inner {
        let words = format!("{words}{gap} {}", inner.get_name());
        list(text, inner, &words, level + 1);
    }
}

#[test]
fn the_manual_lists_every_command_with_its_options() {
    let mut command = Cli::command();
    command.build();
    let mut text = String::new();
    for (group, names) in GROUPS {
        let _ = writeln!(text, "\n## {group}");
        for name in names {
            let inner = command.find_subcommand(name).unwrap();
            list(&mut text, inner, &format!("trueaxis {name}"), 3);
        }
    }
    for (name, _) in PAGES {
        assert!(text.contains(&format!("# `{name}`\n")), "{name}");
    }
    let page = path("commands");
    let whole = std::fs::read_to_string(&page).unwrap();
    let (by_hand, listed) = whole.split_once(MARK).unwrap();
    if std::env::var_os("UPDATE_COMMANDS").is_some() {
        std::fs::write(&page, format!("{by_hand}{MARK}{text}")).unwrap();
        return;
    }
    let drift = listed.lines().zip(text.lines()).find(|(a, b)| a != b);
    assert!(listed == text, "write it with UPDATE_COMMANDS=1: {drift:?}");
}
