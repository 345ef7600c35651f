//! What the check must refuse: corrected programs with one mistake each, as a writer might make it.

use super::random::{Bench, rules};
use trueaxis_gcode::check::{CheckError, CheckResult, Corrected, check};
use trueaxis_gcode::line_map::{Entry, LineMap, Role};
use trueaxis_gcode::offsets::System;
use trueaxis_gcode::{Corrector, Options, Rules, Tables, stream};
use trueaxis_model::validate::Runtime;

/// Moves that are divided, reversals, arcs, an offset, cycles, feeds that change, modes and words M.
const PROGRAM: &str = "G21 G90 G17 G94 G54 G98 F600
M3 S500
G0 X-60 Y-40 Z20 A0 C0 (start)
G1 X60 Y30 (line)
X20 A20 C30 (turned)
G93 G1 X-10 Y0 A-10 F4 (inverse)
G94 F300
G1 A0 C0 (back)
G2 X40 Y0 I25 J0 (arc)
G3 I-25 Z15 (helix)
G1 Z10 (down)
G92 X0 Y0
G1 X-20 Y5 (shifted)
G92.1
G0 X0 Y0 Z30 (over)
G81 X10 Y10 Z2 R12 (hole)
X20
G83 X30 Z5 R12 Q2 (pecks)
G80
G55 G0 X5 (other)
G54 G20
G1 X1 F20 (inches)
G21
F500
G91 G1 X-5 (relative)
G90 M5
M30
";

/// A corrected program.
#[derive(Clone)]
struct Written {
    lines: Vec<String>,
    entries: Vec<Entry>,
}

struct Desk<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    options: Options,
}

impl Desk<'_> {
    fn write(&self) -> Written {
        let options = self.options;
        let mut corrector = Corrector::new(self.rules, self.tables, None, options, None).unwrap();
        let (mut text, mut map) = (Vec::new(), Vec::new());
        let program = PROGRAM.as_bytes();
        stream::correct(program, &mut text, &mut map, &mut corrector, |_| {}).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut entries = Vec::new();
        let mut map = LineMap::new(map.as_slice()).unwrap();
        let mut roles = Vec::new();
        while !map.is_at_end() {
            map.group(&mut roles).unwrap();
            let group = roles.iter().enumerate();
            entries.extend(group.map(|(k, role)| Entry {
                begins: k == 0,
                role: *role,
            }));
        }
        Written {
            lines: text.lines().map(str::to_owned).collect(),
            entries,
        }
    }

    fn check(&self, written: &Written) -> Result<CheckResult, CheckError> {
        let text = written.lines.join("\n") + "\n";
        let mut map = Vec::new();
        for entry in &written.entries {
            entry.write(&mut map).unwrap();
        }
        let corrected = Corrected {
            text: text.as_bytes(),
            map: map.as_slice(),
        };
        let program = PROGRAM.as_bytes();
        check(
            program,
            corrected,
            self.rules,
            self.tables,
            None,
            None,
            self.options,
        )
    }
}

impl Written {
    /// The line with a comment.
    fn at(&self, comment: &str) -> usize {
        let comment = format!("({comment})");
        let found = self.lines.iter().position(|l| l.contains(&comment));
        found.unwrap_or_else(|| panic!("no {comment} in\n{}", self.lines.join("\n")))
    }

    /// The first line at or behind the one with a comment whose entry is of this kind.
    fn role(&self, comment: &str, is: impl Fn(&Role) -> bool) -> usize {
        let from = self.at(comment);
        let found = self.entries[from..].iter().position(|e| is(&e.role));
        from + found.unwrap()
    }

    /// The first line that moves along the motion with a comment.
    fn along(&self, comment: &str) -> usize {
        self.role(comment, |role| matches!(role, Role::Until(_)))
    }

    /// A piece within a motion that is divided.
    fn piece(&self) -> usize {
        self.role("line", |role| matches!(role, Role::Until(t) if *t < 1.0)) + 1
    }

    fn step(&self) -> usize {
        self.role("turned", |role| *role == Role::Step)
    }

    /// Changes the number of a letter in a line.
    fn number(&mut self, line: usize, letter: char, change: impl Fn(f64) -> f64) {
        let words: Vec<String> = self.lines[line]
            .split(' ')
            .map(|word| match word.strip_prefix(letter) {
                Some(number) => format!("{letter}{:.6}", change(number.parse().unwrap())),
                None => word.to_owned(),
            })
            .collect();
        let changed = words.join(" ");
        assert_ne!(changed, self.lines[line], "no {letter}");
        self.lines[line] = changed;
    }

    fn replace(&mut self, line: usize, from: &str, to: &str) {
        assert!(self.lines[line].contains(from), "{}", self.lines[line]);
        self.lines[line] = self.lines[line].replace(from, to);
    }

    /// Takes a line away, and what the map says of it.
    fn lose(&mut self, line: usize) {
        self.lines.remove(line);
        self.entries.remove(line);
    }

    /// Takes the word of a letter away.
    fn lose_word(&mut self, line: usize, letter: char) {
        let words = self.lines[line].split(' ');
        let words: Vec<&str> = words.filter(|w| !w.starts_with(letter)).collect();
        let left = words.join(" ");
        assert_ne!(left, self.lines[line], "no {letter}");
        self.lines[line] = left;
    }
}

type Mutation = (&'static str, fn(&mut Written));

const MUTATIONS: [Mutation; 30] = [
    ("a wrong sign", |w| w.number(w.at("line"), 'Y', |y| -y)),
    ("a piece a micrometre off", |w| {
        w.number(w.piece(), 'X', |x| x + 0.001)
    }),
    ("an end a micrometre off", |w| {
        w.number(w.at("down"), 'Z', |z| z + 0.001)
    }),
    ("a lost line", |w| {
        w.lines.remove(w.piece());
    }),
    ("a lost piece that the map does not know", |w| {
        w.lose(w.piece())
    }),
    ("a line twice", |w| {
        let line = w.piece();
        w.lines.insert(line, w.lines[line].clone());
    }),
    ("two lines in another order", |w| {
        let line = w.piece();
        w.lines.swap(line, line + 1);
    }),
    ("a stale feed", |w| w.lose_word(w.along("back"), 'F')),
    ("twice the feed", |w| {
        w.number(w.at("inverse"), 'F', |f| 2.0 * f)
    }),
    ("the axes exchanged", |w| {
        let line = w.at("start");
        w.lines[line] = w.lines[line]
            .replace('X', "x")
            .replace('Y', "X")
            .replace('x', "Y");
    }),
    ("a rapid for a feed", |w| {
        w.replace(w.at("line"), "G1", "G0")
    }),
    ("a feed for a rapid", |w| {
        w.replace(w.at("over"), "G0", "G1")
    }),
    ("the other way round", |w| {
        w.replace(w.along("arc"), "G2", "G3")
    }),
    ("a centre 20 micrometres off", |w| {
        w.number(w.along("arc"), 'I', |i| i + 0.02)
    }),
    ("a centre on the other side", |w| {
        w.number(w.along("arc"), 'I', |i| -i)
    }),
    ("a helix without its height", |w| {
        w.lose_word(w.role("helix", |_| true) + 1, 'Z')
    }),
    ("a hole that is too deep", |w| {
        w.number(w.at("hole"), 'Z', |z| z - 0.001)
    }),
    ("R of a hole as it was", |w| {
        w.number(w.at("hole"), 'R', |_| 12.01)
    }),
    ("a hole beside its place", |w| {
        w.number(w.at("hole") + 1, 'X', |x| x + 0.001)
    }),
    ("other pecks", |w| w.number(w.at("pecks"), 'Q', |q| q + 0.5)),
    ("another cycle", |w| w.replace(w.at("hole"), "G81", "G85")),
    ("another level", |w| w.replace(0, "G98", "G99")),
    ("the spindle left as it is", |w| w.replace(1, "M3", "")),
    ("an offset that is not corrected", |w| {
        let line = w.lines.iter().position(|l| l.starts_with("G92 ")).unwrap();
        w.lines[line] = "G92 X0 Y0".to_owned();
    }),
    ("a lost step at a reversal", |w| w.lose(w.step())),
    ("a step at a reversal the other way", |w| {
        let line = w.step();
        w.number(line, 'X', |x| x - 0.016);
    }),
    ("an angle 0.1 millidegrees off", |w| {
        w.number(w.at("turned"), 'C', |c| c + 1e-4)
    }),
    ("the other coordinate system", |w| {
        w.replace(w.at("other"), "G55 ", "")
    }),
    ("a line at the end", |w| {
        w.lines.push("G0 X0".to_owned());
        let end = w.lines.len() - 2;
        w.lines[end] = "M0".to_owned();
    }),
    ("a map that ends too early", |w| {
        w.entries.pop();
    }),
];

#[test]
fn thirty_mistakes_of_a_writer_are_found() {
    let bench = Bench::five();
    let runtime = Runtime::load(&bench.blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    let mut rules = rules(&bench, &tables);
    for number in [1, 2] {
        let mut middle = System::default();
        middle.origin[..3].copy_from_slice(&[200.0, 150.0, -125.0]);
        middle.origin[0] += 3.0 * f64::from(number - 1);
        rules.setup.systems.insert(number, middle);
    }
    let desk = Desk {
        rules: &rules,
        tables: &tables,
        options: Options::default(),
    };
    let written = desk.write();
    let found = desk.check(&written);
    let text = || written.lines.join("\n");
    assert!(
        found.as_ref().is_ok_and(|f| f.holds(&desk.options)),
        "{found:?}\n{}",
        text()
    );
    for (what, mutate) in MUTATIONS {
        let mut wrong = written.clone();
        mutate(&mut wrong);
        let found = desk.check(&wrong);
        let is_found = found
            .as_ref()
            .map_or(true, |found| !found.holds(&desk.options));
        assert!(
            is_found,
            "{what}: {found:?}\n{}\n\n{}",
            text(),
            wrong.lines.join("\n")
        );
    }
}
