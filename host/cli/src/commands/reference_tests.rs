//! `docs/src/commands.md` lists every command and option. `UPDATE_COMMANDS=1` rewrites the list; review the diff.

use super::Cli;
use super::groups::GROUPS;
use clap::{Arg, ArgAction, Command, CommandFactory};
use std::fmt::Write;

/// Everything below this line of the page is the list.
const MARK: &str = "<!-- From here on: UPDATE_COMMANDS=1 cargo test -p trueaxis-cli --bin trueaxis reference -->\n";

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

/// The sentence that names the page of the manual for a command, which is written by hand.
fn page_link<'a>(listed: &'a str, name: &str) -> &'a str {
    let own = listed.split_once(&format!("# `{name}`\n\n"));
    let about = own
        .and_then(|(_, own)| own.lines().next())
        .unwrap_or_default();
    about.find(" See [").map_or("", |start| &about[start..])
}

/// Appends a command and those below it. `words` call it, `level` is the depth of its heading.
fn list(text: &mut String, listed: &str, command: &Command, words: &str, level: usize) {
    let name = words.replace(" …", "");
    let name = name.trim_start_matches("trueaxis ");
    let about = command.get_about().map(ToString::to_string);
    let _ = writeln!(
        text,
        "\n{} `{name}`\n\n{}.{}",
        "#".repeat(level),
        about.unwrap_or_default(),
        page_link(listed, name)
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
        list(text, listed, inner, &words, level + 1);
    }
}

#[test]
fn the_manual_lists_every_command_with_its_options() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/commands.md");
    let whole = std::fs::read_to_string(page).unwrap();
    let (by_hand, listed) = whole.split_once(MARK).unwrap();
    let mut command = Cli::command();
    command.build();
    let mut text = String::new();
    for (group, names) in GROUPS {
        let _ = writeln!(text, "\n## {group}");
        for name in names {
            let inner = command.find_subcommand(name).unwrap();
            list(&mut text, listed, inner, &format!("trueaxis {name}"), 3);
        }
    }
    if std::env::var_os("UPDATE_COMMANDS").is_some() {
        std::fs::write(page, format!("{by_hand}{MARK}{text}")).unwrap();
        return;
    }
    let drift = listed.lines().zip(text.lines()).find(|(a, b)| a != b);
    assert!(listed == text, "write it with UPDATE_COMMANDS=1: {drift:?}");
}
