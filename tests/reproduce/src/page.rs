//! The page in `docs/evidence`.

use super::{Chapter, Compared, Figure, Fixed, Reproduced};
use std::fmt::Write;

const HEAD: &str = "# The document's figures, recomputed

<!-- Written by `cargo xtask reproduce`: change that, not this. -->

`cargo xtask reproduce` writes this page, its pictures, and `reproduced.json` with the same for programs;
`cargo xtask reproduce --check` recomputes all of it, compares, and holds what is fixed from outside. *Ours* is what the
same scheme gives here; beside it stands what [`exact`](../src/exact.md) gives instead, under the policies
[*orientation* and *direction*](../src/policies.md). Machines, parameters and strategies are those that the document publishes
(`examples/`). Where something unpublished was inferred from some of its figures, the chapter says from which; all
others are predictions. Displacements of the tip are *raw* (by the errors of the machine) or *set-up-free* (without what
another place of ball and stylus would explain). Misprints: [The source document, reproduced](reproduction.md).
";

/// The page (Markdown), with pictures in the folder `pictures` beside it.
#[must_use]
pub fn page(reproduced: &Reproduced) -> String {
    let mut text = HEAD.to_owned();
    let chapters = &reproduced.chapters;
    for parts in chapters.chunk_by(|a, b| title(a).0 == title(b).0) {
        write_chapter(&mut text, parts);
    }
    if !reproduced.not_reproduced.is_empty() {
        text += "\n## What cannot be recomputed\n\n| what | what would be needed |\n|---|---|\n";
        for missing in &reproduced.not_reproduced {
            let _ = writeln!(text, "| {} | {} |", missing.what, missing.needed);
        }
    }
    text
}

/// The chapter and its part.
fn title(chapter: &Chapter) -> (&str, &str) {
    chapter
        .title
        .split_once(": ")
        .unwrap_or((chapter.title, ""))
}

/// One table for all parts of a chapter, with every reason once.
fn write_chapter(text: &mut String, parts: &[Chapter]) {
    match parts {
        [only] => {
            let _ = write!(text, "\n## {}\n\n", only.title);
            wrap(text, "", only.how);
        }
        _ => {
            let _ = write!(text, "\n## {}\n\n", title(&parts[0]).0);
            for part in parts {
                wrap(text, "- ", &format!("**{}**: {}", title(part).1, part.how));
            }
        }
    }
    write_compared(text, parts);
    for picture in parts.iter().flat_map(|part| &part.pictures) {
        let _ = write!(
            text,
            "\n![{}](pictures/{}.svg)\n",
            picture.title, picture.name
        );
    }
    let mut fixed: Vec<&Fixed> = Vec::new();
    for one in parts.iter().flat_map(|part| &part.fixed) {
        if !fixed.contains(&one) {
            fixed.push(one);
        }
    }
    write_statements(text, "Fixed from outside", &fixed);
}

fn write_statements(text: &mut String, head: &str, statements: &[&Fixed]) {
    if statements.is_empty() {
        return;
    }
    let _ = write!(text, "\n{head}:\n\n");
    for one in statements {
        let holds = if one.holds { "holds" } else { "does not hold" };
        let said = format!("{}: {} ({holds}).", one.statement, one.found);
        wrap(text, "- ", &said);
    }
}

/// A row of the table without its reason.
fn row(part: &Chapter, one: &Compared) -> String {
    let exact = [&one.exact_orientation, &one.exact_direction];
    let [document, ours] = [&one.document, &one.ours].map(Figure::text);
    let exact = exact.map(Figure::text).join(" | ");
    let (what, quantity, unit) = (&one.what, one.quantity.word(), one.unit);
    let source = match one.source {
        "" => part.source,
        source => source,
    };
    format!("| {what} | {quantity} | {source} | {unit} | {document} | {ours} | {exact} |")
}

fn write_compared(text: &mut String, parts: &[Chapter]) {
    let mut reasons: Vec<&str> = Vec::new();
    text.push_str(
        "\n| figure | quantity | where | | document | ours | exact, orientation | exact, direction | why |\n\
        |---|---|---|---|--:|--:|--:|--:|--:|\n",
    );
    for part in parts {
        if parts.len() > 1 {
            let _ = writeln!(text, "| **{}** | | | | | | | | |", title(part).1);
        }
        for one in &part.compared {
            let why = one.why.map_or(String::new(), |why| {
                let known = reasons.iter().position(|reason| *reason == why);
                let number = known.unwrap_or_else(|| {
                    reasons.push(why);
                    reasons.len() - 1
                });
                (number + 1).to_string()
            });
            let _ = writeln!(text, "{} {why} |", row(part, one));
        }
    }
    if !reasons.is_empty() {
        text.push_str("\nWhy:\n\n");
        for (number, reason) in reasons.iter().enumerate() {
            wrap(text, &format!("{}. ", number + 1), &format!("{reason}."));
        }
    }
}

/// Maximum line width of the manual, in characters.
const WIDE: usize = 118;

/// Wraps words into lines, with a mark before the first and the others indented below its text.
fn wrap(text: &mut String, mark: &str, words: &str) {
    let mut line = mark.to_owned();
    let mut is_empty = true;
    for word in words.split_whitespace() {
        let room = line.chars().count() + 1 + word.chars().count();
        if !is_empty && room > WIDE {
            text.push_str(line.trim_end());
            text.push('\n');
            line = " ".repeat(mark.len());
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line.push_str(word);
        is_empty = false;
    }
    text.push_str(line.trim_end());
    text.push('\n');
}
