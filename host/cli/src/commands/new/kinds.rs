//! Kinds of machines to begin with. The page's machine builder offers the same.

/// A kind of machine.
pub struct MachineKind {
    pub name: &'static str,
    pub words: &'static str,
    /// From the workpiece w to the tool t; F is the foundation, S the spindle.
    pub topology: &'static str,
}

const fn kind(name: &'static str, words: &'static str, topology: &'static str) -> MachineKind {
    MachineKind {
        name,
        words,
        topology,
    }
}

/// All kinds, the simplest first.
pub const KINDS: [MachineKind; 7] = [
    kind("router", "three axes, router", "wFYXZSt"),
    kind("mill", "three axes, moving table", "wXYFZSt"),
    kind("trunnion", "trunnion, A and C in the table", "wCAYFXZSt"),
    kind("trunnion-column", "trunnion on a column", "wCBFXYZSt"),
    kind("table-head", "table and head", "wCYFXZBSt"),
    kind("fork-head", "fork head", "wFXYZCASt"),
    kind("gantry", "gantry with fork head", "wFXYZCBSt"),
];

/// A kind by its name.
pub fn named(name: &str) -> Option<&'static MachineKind> {
    KINDS.iter().find(|kind| kind.name == name)
}

#[cfg(test)]
mod tests {
    use super::KINDS;

    #[test]
    fn the_page_offers_the_same_kinds() {
        let page = include_str!("../../../../../web/builder.js");
        let start = page.find("const KINDS = {").unwrap();
        let list = &page[start..start + page[start..].find("};").unwrap()];
        let lines = list.lines().filter(|line| line.contains("\": \""));
        let offered: Vec<String> = lines.map(|line| line.trim().to_owned()).collect();
        let own = KINDS
            .iter()
            .map(|k| format!("\"{}\": \"{}\",", k.words, k.topology));
        assert_eq!(own.collect::<Vec<_>>(), offered);
    }
}
