//! No module of a crate uses a module that uses it, directly or indirectly; nor do the files within a folder.
//!
//! Considered are the files of the crates here and in `lab` without comments and tests: `crate::MODULE`, and between the
//! files of a folder, at any depth, `crate::FOLDER::FILE` and `super::FILE`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// For each module, the modules that it uses.
type Uses = BTreeMap<String, BTreeSet<String>>;

/// Path of the workspace.
fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Source folders of the crates of this workspace and of `lab`, relative to this one.
fn sources() -> Vec<String> {
    let of = |folder: &str| {
        let manifest = workspace().join(folder).join("Cargo.toml");
        let text = fs::read_to_string(manifest).unwrap();
        let (_, members) = text.split_once("members = [").unwrap();
        let (members, _) = members.split_once(']').unwrap();
        let quoted = members.split('"').skip(1).step_by(2);
        let sources = quoted.map(|member| format!("{folder}{member}/src"));
        sources.collect::<Vec<String>>()
    };
    [of(""), of("lab/")].concat()
}

/// The code of a file without comments, and without the tests at its end.
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
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.entry(module.unwrap()).or_default().push(path);
        }
    }
    found
}

/// The names that follow `before` where it occurs in `code` as a separate word.
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

/// For each module in a folder, the modules there that it uses. `path` precedes their names from the root of the crate.
fn uses(folder: &Path, path: &str) -> Uses {
    let all = modules(folder);
    let mut uses = Uses::new();
    for (module, files) in &all {
        // The file of the folder itself may use its contents.
        if ["lib", "main", "mod"].contains(&module.as_str()) {
            continue;
        }
        let used = uses.entry(module.clone()).or_default();
        for file in files {
            let code = code(file);
            let inner = file.strip_prefix(folder).unwrap().components().count();
            let up = "super::".repeat(inner - usize::from(file.ends_with("mod.rs")));
            let names = [path, &up]
                .into_iter()
                .flat_map(|before| names(&code, before));
            let others = names.filter(|name| all.contains_key(*name) && name != module);
            used.extend(others.map(str::to_owned));
        }
    }
    uses
}

/// The cycles in a folder and in its subfolders.
fn circles(folder: &Path, path: &str) -> Vec<String> {
    let way = circle(&uses(folder, path));
    let mut found = Vec::new();
    found.extend(way.map(|way| format!("{path} {}", way.join(" → "))));
    for entry in fs::read_dir(folder).unwrap() {
        let inner = entry.unwrap().path();
        let name = inner.file_name().unwrap().to_str().unwrap();
        if inner.is_dir() && name != "tests" {
            found.extend(circles(&inner, &format!("{path}{name}::")));
        }
    }
    found
}

/// A path from a module back to itself.
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

#[test]
fn no_modules_of_a_crate_and_no_files_of_a_folder_use_each_other() {
    let mut found = Vec::new();
    for source in sources() {
        let circles = circles(&workspace().join(&source), "crate::");
        found.extend(circles.iter().map(|circle| format!("{source}: {circle}")));
    }
    assert!(found.is_empty(), "circles:\n{}", found.join("\n"));
}

#[test]
fn what_modules_use_is_found() {
    let sources = sources();
    for source in [
        "shared/src",
        "firmware/capi/src",
        "xtask/src",
        "lab/gcode/src",
    ] {
        assert!(sources.iter().any(|known| known == source), "{source}");
    }
    let commands = "host/cli/src/commands";
    for (folder, path, module, used) in [
        ("shared/src", "crate::", "compensation", "kernel"),
        ("shared/src", "crate::", "kernel", "plan"),
        ("firmware/src/slots", "crate::slots::", "choices", "layout"),
        ("lab/linuxcnc/src", "crate::", "motion", "bench"),
        // From files in folders of their own: `crate::commands::number`, `super::super::files`.
        (commands, "crate::commands::", "export", "number"),
        (commands, "crate::commands::", "simulate", "files"),
    ] {
        let uses = uses(&workspace().join(folder), path);
        assert!(uses[module].contains(used), "{folder}: {module}, {used}");
    }
}

// A name merely re-exported by the root would hide the real dependency.
#[test]
fn what_the_runtime_uses_from_its_root_is_a_module() {
    let root = workspace().join("shared/src");
    let lib = fs::read_to_string(root.join("lib.rs")).unwrap();
    let lines: Vec<&str> = lib.lines().collect();
    let for_tests = lines.windows(2).filter_map(|pair| {
        let gated = pair[0].starts_with("#[cfg(all(test,");
        pair[1].strip_prefix("mod ").filter(|_| gated)
    });
    let mut all = modules(&root);
    for module in for_tests.chain(["lib;"]) {
        assert!(
            all.remove(module.trim_end_matches(';')).is_some(),
            "{module}"
        );
    }
    for file in all.values().flatten() {
        for name in names(&code(file), "crate::") {
            let is_module = all.contains_key(name);
            assert!(
                is_module,
                "{}: crate::{name} is not a module",
                file.display()
            );
        }
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
