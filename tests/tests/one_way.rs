//! No module of the runtime uses one that uses it, over however many others.
//!
//! What counts is what stands in the files of `shared/src` outside comments and tests: `crate::MODULE`, and
//! between the files of a folder `super::FILE`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Which modules each module uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/src")
}

/// The code of a file without comments, and without the tests that it ends with.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let lines = text.lines().map(str::trim_start);
    let lines: Vec<&str> = lines.filter(|line| !line.starts_with("//")).collect();
    let tests = lines.windows(2).position(|pair| {
        let [gate, module] = [pair[0], pair[1]];
        (gate == "#[cfg(test)]" || gate.starts_with("#[cfg(all(test,"))
            && module.starts_with("mod tests")
    });
    lines[..tests.unwrap_or(lines.len())].join("\n")
}

/// Modules of `lib.rs` that are there for tests only.
fn for_tests() -> BTreeSet<String> {
    let text = fs::read_to_string(root().join("lib.rs")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let gated = lines
        .windows(2)
        .filter(|pair| pair[0].starts_with("#[cfg(all(test,"));
    gated
        .filter_map(|pair| Some(pair[1].strip_prefix("mod ")?.trim_end_matches(';').into()))
        .collect()
}

/// The modules in a folder with their files: `x` is in `x.rs` and below `x/`. Tests are left out.
fn modules(folder: &Path) -> BTreeMap<String, Vec<PathBuf>> {
    let mut found: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    let mut pending: Vec<(Option<String>, PathBuf)> = vec![(None, folder.into())];
    while let Some((module, path)) = pending.pop() {
        let stem = path.file_stem().unwrap().to_str().unwrap();
        if module.is_some() && stem == "tests" {
            continue;
        }
        if path.is_dir() {
            for entry in fs::read_dir(&path).unwrap() {
                let inner = entry.unwrap().path();
                let name = inner.file_stem().unwrap().to_str().unwrap().to_owned();
                pending.push((Some(module.clone().unwrap_or(name)), inner));
            }
        } else {
            found.entry(module.unwrap()).or_default().push(path);
        }
    }
    found
}

/// What follows `before` wherever that stands in `code` as a word of its own: a name.
fn names<'c>(code: &'c str, before: &str) -> Vec<&'c str> {
    let follows = code.match_indices(before).filter(|&(place, _)| {
        let last = code[..place].chars().next_back();
        !last.is_some_and(|c| c.is_alphanumeric() || "_$:".contains(c))
    });
    follows
        .map(|(place, _)| {
            let rest = &code[place + before.len()..];
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            &rest[..end.unwrap_or(rest.len())]
        })
        .collect()
}

/// A way from a module back to itself.
fn circle(uses: &Uses) -> Option<Vec<String>> {
    fn follow(uses: &Uses, way: &mut Vec<String>, clear: &mut BTreeSet<String>) -> bool {
        let last = way[way.len() - 1].clone();
        for next in uses.get(&last).into_iter().flatten() {
            if clear.contains(next) {
                continue;
            }
            let begun = way.iter().position(|module| module == next);
            way.push(next.clone());
            if let Some(begun) = begun {
                way.drain(..begun);
                return true;
            }
            if follow(uses, way, clear) {
                return true;
            }
            way.pop();
        }
        clear.insert(last);
        false
    }
    let mut clear = BTreeSet::new();
    uses.keys().find_map(|module| {
        let mut way = vec![module.clone()];
        follow(uses, &mut way, &mut clear).then_some(way)
    })
}

fn assert_one_way(uses: &Uses) {
    if let Some(way) = circle(uses) {
        panic!("a circle: {}", way.join(" → "));
    }
}

#[test]
fn no_modules_of_the_runtime_use_each_other() {
    let all = modules(&root());
    let (mut uses, tests) = (Uses::new(), for_tests());
    for (module, files) in &all {
        if module == "lib" || tests.contains(module) {
            continue;
        }
        let used = uses.entry(module.clone()).or_default();
        for file in files {
            for name in names(&code(file), "crate::") {
                // A name that the root only hands on would hide what is used.
                let known = all.contains_key(name) && !tests.contains(name);
                assert!(known, "{}: crate::{name} is no module", file.display());
                if name != module {
                    used.insert(name.into());
                }
            }
        }
    }
    assert!(uses["compensation"].contains("kernel") && uses["kernel"].contains("plan"));
    assert_one_way(&uses);
}

#[test]
fn no_files_of_a_folder_of_the_runtime_use_each_other() {
    let mut found = Vec::new();
    for entry in fs::read_dir(root()).unwrap() {
        let folder = entry.unwrap().path();
        if !folder.is_dir() {
            continue;
        }
        let all = modules(&folder);
        let mut uses = Uses::new();
        for (module, files) in &all {
            // The file of the folder itself uses what is in it.
            if module == "mod" {
                continue;
            }
            let used = uses.entry(module.clone()).or_default();
            for name in files.iter().flat_map(|file| {
                let code = code(file);
                let names = names(&code, "super::").into_iter();
                names.map(str::to_owned).collect::<Vec<_>>()
            }) {
                if all.contains_key(&name) && name != *module {
                    used.insert(name);
                }
            }
        }
        assert_one_way(&uses);
        found.extend(uses.into_values().flatten());
    }
    for used in ["slot", "progress", "span", "terms"] {
        assert!(found.iter().any(|name| name == used), "{used} is not used");
    }
}

#[test]
fn a_circle_is_found_over_any_number_of_modules() {
    let uses = |edges: &[(&str, &str)]| {
        let mut uses = Uses::new();
        for &(from, to) in edges {
            uses.entry(from.into()).or_default().insert(to.into());
        }
        circle(&uses).map(|way| way.join(" "))
    };
    assert_eq!(
        uses(&[("a", "b"), ("a", "c"), ("b", "c"), ("c", "d")]),
        None
    );
    assert_eq!(uses(&[("a", "b"), ("b", "a")]).unwrap(), "a b a");
    let three = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "b")];
    assert_eq!(uses(&three).unwrap(), "b c d b");
}

#[test]
fn only_paths_from_the_root_of_the_crate_count() {
    let code = "use crate::a::B; x(crate::c::D, $crate::E, pub(crate) fn, not_crate::f)";
    assert_eq!(names(code, "crate::"), ["a", "c"]);
}
