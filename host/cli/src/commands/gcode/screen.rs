//! What people and programs read.

use serde::Serialize;
use std::path::Path;
use trueaxis_gcode::axes;
use trueaxis_gcode::check::{CheckResult, Statistics, ToolPath};
use trueaxis_gcode::modal::Units;
use trueaxis_gcode::{Backlash, Options, Report, Tables};
use trueaxis_model::machine::Machine;

/// The largest correction of an axis.
#[derive(Serialize)]
struct Largest {
    axis: char,
    unit: &'static str,
    correction: f64,
    line: u64,
}

/// Tools of a program, beside the one that a compensation without length input was made for.
#[derive(Serialize)]
pub struct Lengths {
    /// What the program uses (mm), where it is known.
    used_mm: Vec<f64>,
    /// What the compensation was made for (mm), by the machine file; none if it takes the length in.
    made_for_mm: Option<f64>,
    /// True if the tool length is an input of the compensation.
    is_input: bool,
}

impl Lengths {
    pub fn new(report: &Report, tables: &Tables<'_>, machine: Option<&Machine>) -> Self {
        let is_input = tables.takes_length;
        let made_for = machine
            .filter(|_| !is_input)
            .map(|machine| machine.tool_length());
        Self {
            used_mm: report.lengths.iter().map(|um| *um as f64 * 1e-3).collect(),
            made_for_mm: made_for,
            is_input,
        }
    }

    /// What there is to be warned of.
    pub fn warning(&self, found: Option<&CheckResult>) -> Option<String> {
        let own = self.made_for_mm?;
        let differs = |l: &f64| (l - own).abs() > 1e-3;
        let others: Vec<f64> = self.used_mm.iter().copied().filter(differs).collect();
        if others.is_empty() {
            return None;
        }
        let cost = match found.filter(|f| f.tool_path.is_some()) {
            Some(found) => format!(
                "that makes up to {:.2} µm at the tip{}",
                found.length_um,
                place(found.length_line)
            ),
            None => "--check with --errors shows what that means at the tip".to_owned(),
        };
        Some(format!(
            "tool length {} mm, and the compensation was made for {own:.3} mm, without length input: {cost}",
            shown(&others)
        ))
    }

    /// What is not known.
    pub fn note(&self) -> String {
        match self.made_for_mm {
            None if !self.is_input && !self.used_mm.is_empty() => format!(
                "tool length {} mm: pass --machine to see whether the compensation was made for it\n",
                shown(&self.used_mm)
            ),
            _ => String::new(),
        }
    }
}

/// Behind what is largest there: nothing where it is nowhere.
fn place(line: u64) -> String {
    match line {
        0 => String::new(),
        line => format!(" (line {line})"),
    }
}

fn shown(lengths: &[f64]) -> String {
    let lengths: Vec<String> = lengths.iter().map(|l| format!("{l:.3}")).collect();
    lengths.join(", ")
}

/// For programs.
#[derive(Serialize)]
pub struct Answer<'a> {
    file: &'a Path,
    compensation: &'a str,
    tool_length: &'a Lengths,
    #[serde(flatten)]
    report: &'a Report,
    largest: Vec<Largest>,
    check: Option<&'a CheckResult>,
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
        tool_length: &'a Lengths,
        check: Option<&'a CheckResult>,
    ) -> Self {
        Self {
            file,
            compensation: compensation.machine(),
            tool_length,
            report,
            largest: largest(report),
            check,
        }
    }
}

/// For people.
pub fn report(file: &Path, report: &Report, options: &Options) -> String {
    let [read, written] = report.lines;
    let mut text = format!("{}: {written} lines for {read}\n", file.display());
    text += &moves(report, options);
    text += &words(report, options);
    for largest in largest(report) {
        let Largest {
            axis,
            unit,
            correction,
            line,
        } = largest;
        text += &format!("{axis}   largest correction {correction:>10.5} {unit} in line {line}\n");
    }
    text += &left(report, options);
    text
}

/// What became of moves, arcs and cycles.
fn moves(report: &Report, options: &Options) -> String {
    let (arcs, cycles, written_out) = (report.arcs, report.cycles, &report.written_out);
    let mut text = format!(
        "{} motions corrected, {} of them cut; arcs: {} stay, {} are chords; cycles: {} stay, {} are written out\n",
        report.moves, report.cut, arcs[0], arcs[1], cycles[0], cycles[1]
    );
    if cycles[0] > 0 {
        text += &format!(
            "holes of cycles: at most {:.2} µm from their corrected places, {:.1} µm are allowed\n",
            report.holes_off * 1e3,
            options.hole_tolerance * 1e3
        );
    }
    for (line, why) in written_out {
        text += &format!("line {line} is written out: {why}\n");
    }
    if cycles[1] > written_out.len() as u64 {
        text += &format!("and {} others\n", cycles[1] - written_out.len() as u64);
    }
    if report.take_ups > 0 {
        let how = match options.backlash {
            Backlash::Blend => "are blended into the moves that reverse",
            _ => "are moves of their own",
        };
        text += &format!("{} steps at reversals {how}\n", report.take_ups);
    }
    text
}

/// What is to be known of the words written.
fn words(report: &Report, options: &Options) -> String {
    let mut text = String::new();
    if let Some(decimals) = options.decimals {
        text += &format!(
            "words have {decimals} decimals: rounding costs up to {:.2} µm in X, Y and Z together\n",
            options.rounding(Units::Millimetre) * 1e3
        );
    }
    if report.feeds > 0 {
        text += &format!(
            "{} words F keep the time of a move, or restore the feed of the program\n",
            report.feeds
        );
    }
    if report.under_cutter > 0 {
        text += &format!(
            "{} moves under G41 or G42 have corrected ends and are not cut: up to {:.2} µm between\n",
            report.under_cutter,
            report.under_cutter_off * 1e3
        );
    }
    text
}

/// What remains to be known: what is left out or not corrected.
fn left(report: &Report, options: &Options) -> String {
    let mut text = String::new();
    let decimals = report.decimals;
    if options.decimals.is_none() && decimals[1] > decimals[0] {
        text += &format!(
            "words have up to {} decimals, in the program up to {}: the tolerance needs them\n",
            decimals[1], decimals[0]
        );
    }
    if report.zeros_of_centres > 0 {
        text += &format!(
            "warning: {} words I, J or K across the plane of an arc, all 0, are left out: LinuxCNC refuses them\n",
            report.zeros_of_centres
        );
    }
    if !report.other_axes.is_empty() {
        let axes: Vec<String> = report.other_axes.iter().map(char::to_string).collect();
        text += &format!(
            "words of {} are passed: the machine does not have the axis, and they never change\n",
            axes.join(", ")
        );
    }
    for (what, times) in &report.passed {
        text += &format!("not corrected: {what} ({times} times)\n");
    }
    text
}

/// Where the corrected program is not what was asked for.
fn not_held(found: &CheckResult) -> String {
    let mut text = String::new();
    if found.excess_um > 0.0 {
        text += &format!(
            "  {:.2} µm farther from the corrected path than allowed in line {}\n",
            found.excess_um, found.excess_line
        );
    }
    if found.times_differ > 0 {
        text += &format!(
            "  the time of {} motions differs by more than 1 %, first in line {}\n",
            found.times_differ, found.first_time_line
        );
    }
    text
}

/// What the check says, for people.
pub fn check(found: &CheckResult, options: &Options) -> String {
    let mut text = String::from("check: both programs read anew\n");
    text += &format!(
        "  {} motions for {}; at most {:.2} µm from the corrected path{}{}\n",
        found.motions[1],
        found.motions[0],
        found.off_um,
        place(found.off_line),
        match found.off_urad {
            0.0 => String::new(),
            off => format!(", {off:.2} µrad of a rotary axis"),
        }
    );
    if found.hole_um > 0.0 {
        text += &format!(
            "  holes at most {:.2} µm from their corrected places{}\n",
            found.hole_um,
            place(found.hole_line)
        );
    }
    if found.blended_um > 0.0 {
        text += &format!(
            "  where an axis reverses, and the step is blended into the move: {:.2} µm\n",
            found.blended_um
        );
    }
    for (unit, [before, after]) in [("min", found.minutes), ("revolutions", found.revolutions)] {
        if unit == "min" || before > 0.0 {
            text += &format!("  feed moves take {after:.2} {unit}, before {before:.2} {unit}\n");
        }
    }
    text += &not_held(found);
    if let Some(path) = &found.tool_path {
        text += &tool(path, found.lines);
    }
    if !found.holds(options) {
        text += "check: failed\n";
    }
    text
}

/// Where the tool goes.
fn tool(path: &ToolPath, [read, written]: [u64; 2]) -> String {
    let mut text = format!(
        "  tool on feed moves      {:>9} {:>9} {:>9}\n",
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
        text += &format!("    {name:<22}{mean:>9.2} {p95:>9.2} {max:>9.2}\n");
    }
    // Less is not worth a line.
    if path.turned_um >= 0.5 {
        text += &format!(
            "  up to {:.1} µm after, because axes go back by no more than their reversal threshold\n",
            path.turned_um
        );
    }
    let more = 100.0 * (written as f64 / read.max(1) as f64 - 1.0);
    let worst = match path.worst_line {
        0 => String::new(),
        line => format!(" (worst in line {line})"),
    };
    text + &format!(
        "if the machine has these errors and no others: {:.1} µm before, {:.1} µm after{worst}; {more:.0} % more lines\n",
        path.before_um.max, path.after_um.max
    )
}
