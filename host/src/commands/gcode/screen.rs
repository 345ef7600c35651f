//! What people and programs read.

use serde::Serialize;
use std::fmt::Write;
use std::path::Path;
use trueaxis_host::gcode::axes;
use trueaxis_host::gcode::check::{Found, Statistics};
use trueaxis_host::gcode::{Options, Report};

/// The largest correction of an axis.
#[derive(Serialize)]
struct Largest {
    axis: char,
    unit: &'static str,
    correction: f64,
    line: u64,
}

/// For programs.
#[derive(Serialize)]
pub struct Answer<'a> {
    file: &'a Path,
    compensation: &'a str,
    #[serde(flatten)]
    report: &'a Report,
    largest: Vec<Largest>,
    check: Option<&'a Found>,
}

fn largest(report: &Report) -> Vec<Largest> {
    let all = report.largest.iter().enumerate();
    all.filter(|(_, (by, _))| *by > 0.0)
        .map(|(axis, (by, line))| Largest {
            axis: axes::name(axis),
            unit: if axes::is_rotary(axis) { "deg" } else { "mm" },
            correction: *by,
            line: *line,
        })
        .collect()
}

impl<'a> Answer<'a> {
    pub fn new(
        file: &'a Path,
        report: &'a Report,
        compensation: &'a trueaxis::Largest<'_>,
        check: Option<&'a Found>,
    ) -> Self {
        Self {
            file,
            compensation: compensation.machine(),
            report,
            largest: largest(report),
            check,
        }
    }
}

/// For people.
pub fn report(file: &Path, report: &Report) -> String {
    let Report {
        lines: [read, written],
        moves,
        cut,
        arcs,
        cycles,
        take_ups,
        feeds,
        under_cutter,
        under_cutter_off,
        decimals,
        passed,
        ..
    } = report;
    let mut text = String::new();
    let _ = writeln!(text, "{}: {written} lines for {read}", file.display());
    let _ = writeln!(
        text,
        "{moves} motions corrected, {cut} of them cut; arcs: {} stay, {} are chords; cycles: {} stay, {} are written out",
        arcs[0], arcs[1], cycles[0], cycles[1]
    );
    if *take_ups > 0 {
        let _ = writeln!(text, "{take_ups} steps at reversals are moves of their own");
    }
    if *feeds > 0 {
        let _ = writeln!(
            text,
            "{feeds} words F keep the time of a move, or come back to that of the program"
        );
    }
    if *under_cutter > 0 {
        let _ = writeln!(
            text,
            "{under_cutter} moves under G41 or G42 have corrected ends and are not cut: up to {:.2} µm between",
            under_cutter_off * 1e3
        );
    }
    for largest in largest(report) {
        let Largest {
            axis,
            unit,
            correction,
            line,
        } = largest;
        let _ = writeln!(
            text,
            "{axis}   largest correction {correction:>10.5} {unit} in line {line}"
        );
    }
    if decimals[1] > decimals[0] {
        let _ = writeln!(
            text,
            "words have up to {} decimals for {}: the tolerance needs them",
            decimals[1], decimals[0]
        );
    }
    for (what, times) in passed {
        let _ = writeln!(text, "not corrected: {what} ({times} times)");
    }
    text
}

/// What the check says, for people.
pub fn check(found: &Found, options: &Options) -> String {
    let mut text = String::from("check: both programs read anew\n");
    let _ = writeln!(
        text,
        "  {} motions for {}; at most {:.2} µm from the corrected path (line {}){}",
        found.motions[1],
        found.motions[0],
        found.off_um,
        found.off_line,
        match found.off_urad {
            0.0 => String::new(),
            off => format!(", {off:.2} µrad of a rotary axis"),
        }
    );
    let [before, after] = found.minutes;
    let _ = writeln!(
        text,
        "  feed moves take {after:.2} min, before {before:.2} min"
    );
    if found.times_differ > 0 {
        let _ = writeln!(
            text,
            "  the time of {} motions differs by more than 1 %, first in line {}",
            found.times_differ, found.first_time_line
        );
    }
    if let Some(path) = &found.tool_path {
        let _ = writeln!(
            text,
            "  tool on feed moves      {:>9} {:>9} {:>9}",
            "mean", "95 %", "max"
        );
        for (name, unit, statistics) in [
            ("before", "µm", &path.before_um),
            ("after", "µm", &path.after_um),
            ("direction before", "µrad", &path.before_urad),
            ("direction after", "µrad", &path.after_urad),
        ] {
            let Statistics { mean, p95, max } = statistics;
            let name = format!("{name}, {unit}");
            let _ = writeln!(text, "    {name:<22}{mean:>9.2} {p95:>9.2} {max:>9.2}");
        }
        let [read, written] = found.lines;
        let more = 100.0 * (written as f64 / read.max(1) as f64 - 1.0);
        let _ = writeln!(
            text,
            "{:.1} µm before, {:.1} µm after (worst in line {}), {more:.0} % more lines",
            path.before_um.max, path.after_um.max, path.worst_line
        );
    }
    if !found.holds(options) {
        text += "check: does not hold\n";
    }
    text
}
