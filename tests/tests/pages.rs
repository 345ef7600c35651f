//! Pages: every link leads somewhere, every page of the manual is reached, and pictures need no style sheet of a page.

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Where pages on the web stand that are files of this project.
const WEB: &str = "https://github.com/trueaxis/trueaxis/blob/main/";

/// A page: the addresses that it links to, pictures included, and the anchors of its headings in their order.
struct Page {
    links: Vec<String>,
    anchors: Vec<String>,
}

/// The anchor that GitHub and mdBook give a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn read(text: &str) -> Page {
    let (mut links, mut anchors, mut heading) = (Vec::new(), Vec::new(), None);
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                links.push(dest_url.into_string());
            }
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                let mut own = anchor(&heading.take().unwrap());
                let before = anchors.iter().filter(|a| **a == own).count();
                if before > 0 {
                    own += &format!("-{before}");
                }
                anchors.push(own);
            }
            Event::Text(part) | Event::Code(part) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&part);
                }
            }
            _ => {}
        }
    }
    Page { links, anchors }
}

fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().unwrap().to_owned()
}

/// `path` without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut found = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(found.pop(), "{}", path.display()),
            Component::CurDir => {}
            part => found.push(part),
        }
    }
    found
}

/// All pages, by their paths in the project: those of the manual and the evidence, and those beside the code.
fn pages() -> BTreeMap<PathBuf, Page> {
    let root = root();
    let mut folders = vec![PathBuf::new()];
    let mut found = BTreeMap::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root.join(&folder)).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            let path = folder.join(&name);
            let kind = entry.file_type().unwrap();
            if kind.is_dir() && !name.starts_with('.') && name != "target" && name != "node_modules"
            {
                folders.push(path);
            } else if kind.is_file() && name.ends_with(".md") {
                let page = read(&fs::read_to_string(root.join(&path)).unwrap());
                found.insert(path, page);
            }
        }
    }
    found
}

/// What a link on the page `from` leads to: a path in the project, and an anchor or nothing. `None` for the web and mail.
fn target(from: &Path, link: &str) -> Option<(PathBuf, String)> {
    let link = link
        .strip_prefix(WEB)
        .map_or(link.to_owned(), |path| format!("/{path}"));
    if link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (path, anchor) = link.split_once('#').unwrap_or((&link, ""));
    let path = match (path.strip_prefix('/'), path) {
        (Some(path), _) => PathBuf::from(path),
        (None, "") => from.to_owned(),
        (None, path) => plain(&from.parent().unwrap().join(path)),
    };
    Some((path, anchor.to_owned()))
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let (pages, mut dead) = (pages(), Vec::new());
    assert!(pages.len() > 70, "{}", pages.len());
    for (from, page) in &pages {
        for link in &page.links {
            let Some((path, anchor)) = target(from, link) else {
                continue;
            };
            let is_there = match pages.get(&path) {
                Some(to) => anchor.is_empty() || to.anchors.contains(&anchor),
                None => root().join(&path).exists(),
            };
            if !is_there {
                dead.push(format!("{}: {link}", from.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

#[test]
fn every_page_of_the_manual_is_in_its_contents_and_linked_from_another() {
    let pages = pages();
    let linked = |from: &Path, page: &Page| -> BTreeSet<PathBuf> {
        let all = page.links.iter().filter_map(|link| target(from, link));
        all.map(|(path, _)| path)
            .filter(|path| path != from)
            .collect()
    };
    let summary = Path::new("docs/src/SUMMARY.md");
    let contents = linked(summary, &pages[summary]);
    let elsewhere: BTreeSet<PathBuf> = (pages.iter().filter(|(path, _)| *path != summary))
        .flat_map(|(path, page)| linked(path, page))
        .collect();
    for path in pages.keys().filter(|path| path.starts_with("docs/src")) {
        assert!(
            path == summary || contents.contains(path),
            "{}",
            path.display()
        );
        assert!(
            path == summary || elsewhere.contains(path),
            "{}",
            path.display()
        );
    }
}

/// The manual stays one that can be read to its end: five per cent more than it has today fail.
#[test]
fn the_manual_has_at_most_48_000_words_beside_its_listings() {
    let (mut words, mut is_listing) = (0, false);
    for (path, _) in pages()
        .iter()
        .filter(|(path, _)| path.starts_with("docs/src"))
    {
        for event in Parser::new_ext(
            &fs::read_to_string(root().join(path)).unwrap(),
            Options::ENABLE_TABLES,
        ) {
            match event {
                Event::Start(Tag::CodeBlock(_)) => is_listing = true,
                Event::End(TagEnd::CodeBlock) => is_listing = false,
                Event::Text(part) | Event::Code(part) if !is_listing => {
                    let all = part.split_whitespace();
                    words += all.filter(|w| w.contains(char::is_alphabetic)).count();
                }
                _ => {}
            }
        }
    }
    println!("{words} words");
    assert!((40_000..=48_000).contains(&words), "{words} words");
}

#[test]
fn pictures_have_their_colours_and_are_on_a_page() {
    let folder = Path::new("docs/src/pictures");
    let shown: BTreeSet<PathBuf> = (pages().iter())
        .flat_map(|(from, page)| {
            page.links
                .iter()
                .filter_map(|link| target(from, link))
                .collect::<Vec<_>>()
        })
        .map(|(path, _)| path)
        .collect();
    let mut of_lines = 0;
    for entry in fs::read_dir(root().join(folder)).unwrap() {
        let path = entry.unwrap().path();
        let name = folder.join(path.file_name().unwrap());
        assert!(shown.contains(&name), "{} is on no page", name.display());
        if path.extension().is_some_and(|kind| kind == "svg") {
            of_lines += 1;
            let text = fs::read_to_string(&path).unwrap();
            // Programs that draw pictures outside browsers know no variables of style sheets, and draw black or nothing.
            assert!(!text.contains("var("), "{}: var()", name.display());
        }
    }
    assert!(of_lines >= 10, "{of_lines}");
}

#[test]
fn anchors_are_those_of_the_web() {
    let page =
        read("# The `exact` scheme: 2nd, *part*\n\n## A\n\n## A\n\n[x](y.md#z) ![p](q.svg)\n");
    assert_eq!(page.anchors, ["the-exact-scheme-2nd-part", "a", "a-1"]);
    assert_eq!(page.links, ["y.md#z", "q.svg"]);
    let to = target(Path::new("docs/src/a.md"), "../b.md#c").unwrap();
    assert_eq!(to, (PathBuf::from("docs/b.md"), "c".to_owned()));
    assert_eq!(target(Path::new("a.md"), "https://example.com/x.md"), None);
}
