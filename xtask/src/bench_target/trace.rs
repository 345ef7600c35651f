//! Every instruction of a run in QEMU, between marks.

use super::cycles::{Cost, cost};
use super::instruction::Instruction;
use crate::elf::ElfProgram;
use crate::qemu;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{ChildStderr, Stdio};

/// `mov r8, r8`, which occurs only before and after the counted code.
const MARK: u16 = 0x46C0;
/// The counter is read between the mark and the counted code, on both sides.
const READS: usize = 2;

/// Costs of the calls made by the program when it is traced, by the key of their figure.
///
/// # Errors
/// If QEMU does not start, the program ends with a message, or the trace does not contain the counted instructions.
pub fn calls(path: &Path) -> Result<Vec<(String, Vec<Cost>)>, String> {
    let program = ElfProgram::read(path)?;
    let mut child = qemu::board(path)
        .args(["-append", "trace"])
        // One line for each instruction.
        .args(qemu::single_steps())
        .args(["-d", "exec,nochain", "-D", "/dev/stderr"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| format!("QEMU does not start: {e}"))?;
    let (Some(mut printed), Some(trace)) = (child.stdout.take(), child.stderr.take()) else {
        return Err("QEMU has no output".to_owned());
    };
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        printed.read_to_string(&mut text).map(|_| text)
    });
    let costs = between_marks(&program, trace);
    // After an error nothing reads the rest.
    if costs.is_err() {
        let _ = child.kill();
    }
    let status = child.wait().map_err(|e| e.to_string())?;
    let text = reader.join().map_err(|_| "the output cannot be read")?;
    let (text, costs) = (text.map_err(|e| e.to_string())?, costs?);
    if !status.success() {
        return Err(format!("the traced run did not come to its end: {text}"));
    }
    by_key(&text, costs)
}

/// Costs of the sequences between two marks, without the reads of the counter, and without the empty sequence that
/// measures the cost of counting itself.
fn between_marks(program: &ElfProgram, trace: ChildStderr) -> Result<Vec<Cost>, String> {
    let mut runs = Runs::default();
    let mut last = None;
    let mut line = Vec::new();
    let mut trace = BufReader::with_capacity(1 << 16, trace);
    loop {
        line.clear();
        let read = trace.read_until(b'\n', &mut line);
        let logged = match read.map_err(|e| e.to_string())? {
            0 => Logged::Other,
            _ => Logged::read(&line),
        };
        match logged {
            // It was about to be executed when QEMU stopped, and is logged again.
            Logged::Undone(address) if last == Some(address) => last = None,
            Logged::Undone(address) => {
                return Err(format!(
                    "QEMU takes back what it has not done, at {address:#x}"
                ));
            }
            Logged::Step(next) => {
                if let Some(address) = last.replace(next) {
                    runs.take(program, address)?;
                }
            }
            Logged::Other if line.is_empty() => return Ok(runs.costs),
            Logged::Other => {}
        }
    }
}

/// Sequences between two marks, from the addresses of all instructions in order.
#[derive(Default)]
struct Runs {
    known: HashMap<u32, FoundContent>,
    /// After a first mark.
    steps: Option<Vec<(u32, Instruction)>>,
    costs: Vec<Cost>,
}

/// Content of an address.
#[derive(Clone, Copy)]
enum FoundContent {
    Mark,
    Instruction(Instruction),
    Unknown,
}

impl Runs {
    fn take(&mut self, program: &ElfProgram, address: u32) -> Result<(), String> {
        let found = self.known.entry(address).or_insert_with(|| {
            let Some((first, second)) = program.code(address) else {
                return FoundContent::Unknown;
            };
            if first == MARK {
                return FoundContent::Mark;
            }
            Instruction::decode(first, second)
                .map_or(FoundContent::Unknown, FoundContent::Instruction)
        });
        match (*found, &mut self.steps) {
            (FoundContent::Mark, None) => self.steps = Some(Vec::new()),
            (FoundContent::Mark, Some(steps)) => {
                if let [_, work @ .., (end, _)] = &steps[..]
                    && steps.len() > READS
                {
                    self.costs.push(cost(work, *end));
                }
                self.steps = None;
            }
            (FoundContent::Instruction(step), Some(steps)) => steps.push((address, step)),
            (FoundContent::Unknown, Some(_)) => {
                return Err(format!("no cycles are known of what is at {address:#x}"));
            }
            (_, None) => {}
        }
        Ok(())
    }
}

/// Meaning of a line of the trace.
#[derive(PartialEq, Eq, Debug)]
enum Logged {
    /// The instruction at an address is about to be executed.
    Step(u32),
    /// It was not executed, or will be again.
    Undone(u32),
    Other,
}

impl Logged {
    fn read(line: &[u8]) -> Self {
        let number = |text: &str| u32::from_str_radix(text.trim(), 16).ok();
        let Ok(text) = str::from_utf8(line) else {
            return Self::Other;
        };
        let brackets = || Some(text.split_once('[')?.1.split_once(']')?.0);
        let found = if text.starts_with("Trace ") {
            let place = brackets().and_then(|places| places.split('/').nth(1));
            place.and_then(number).map(Self::Step)
        } else if text.starts_with("Stopped execution of TB chain before ") {
            brackets().and_then(number).map(Self::Undone)
        } else {
            let place = text.strip_prefix("cpu_io_recompile: rewound execution of TB to ");
            place.and_then(number).map(Self::Undone)
        };
        found.unwrap_or(Self::Other)
    }
}

/// Assigns each cost to the next printed key, which follows lines `call COUNT`, one for each.
fn by_key(printed: &str, costs: Vec<Cost>) -> Result<Vec<(String, Vec<Cost>)>, String> {
    let mut keys = Vec::new();
    let mut costs = costs.into_iter();
    let mut calls = Vec::new();
    for line in printed.lines() {
        let (key, value) = line.split_once(' ').unwrap_or((line, ""));
        if key != "call" {
            if !calls.is_empty() {
                keys.push((key.to_owned(), std::mem::take(&mut calls)));
            }
            continue;
        }
        let cost = costs.next().ok_or("a call is counted that is not traced")?;
        if value.parse() != Ok(cost.instructions) {
            let found = cost.instructions;
            return Err(format!("{value} instructions are counted, {found} traced"));
        }
        calls.push(cost);
    }
    match costs.next() {
        None => Ok(keys),
        Some(_) => Err("a call is traced that is not counted".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::{Cost, Logged, by_key};

    #[test]
    fn lines_of_the_trace_are_read() {
        for (line, says) in [
            (
                "Trace 0: 0x7f0a8c000240 [00000000/00000cd4/00000110/ff000001] main\n",
                Logged::Step(0xCD4),
            ),
            (
                "Stopped execution of TB chain before 0x7f05d417fcc0 [0000caa8] main\n",
                Logged::Undone(0xCAA8),
            ),
            (
                "cpu_io_recompile: rewound execution of TB to 0000caa4\n",
                Logged::Undone(0xCAA4),
            ),
            ("qemu-system-arm: terminating\n", Logged::Other),
        ] {
            assert_eq!(Logged::read(line.as_bytes()), says);
        }
    }

    fn costs(instructions: &[u32]) -> Vec<Cost> {
        let of = |&instructions| Cost {
            instructions,
            ..Cost::default()
        };
        instructions.iter().map(of).collect()
    }

    #[test]
    fn calls_belong_to_the_key_behind_them() {
        let keys = by_key(
            "call 3\ncall 4\na 3\na_max 4\ncall 5\nb 5\n",
            costs(&[3, 4, 5]),
        )
        .unwrap();
        assert_eq!(
            keys,
            [
                ("a".to_owned(), costs(&[3, 4])),
                ("b".to_owned(), costs(&[5]))
            ]
        );
    }

    #[test]
    fn a_trace_that_shows_other_instructions_than_were_counted_is_refused() {
        assert!(by_key("call 3\na 3\n", costs(&[4])).is_err());
        assert!(by_key("call 3\na 3\n", costs(&[])).is_err());
        assert!(by_key("call 3\na 3\n", costs(&[3, 3])).is_err());
    }
}
