//! `cargo xtask bench-target`: instructions on an emulated Cortex-M4F, their cycles according to the manual, code size
//! and stack.

mod cycles;
mod instruction;
mod trace;

use crate::cross::{CORTEX_M, Cross};
use crate::elf::ElfProgram;
use crate::figures::Figures;
use crate::process::{example, judged, root, run, target, trueaxis};
use crate::{blob, files, qemu};
use cycles::Cost;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Permitted growth of a figure over the committed one, per cent.
const GROWTH: u64 = 5;

/// Calls that are counted: key, title, maximum instructions (0: no limit).
const CALLS: [(&str, &str, u64); 29] = [
    ("evaluate_huron13", "evaluate: 13 errors, five axes", 390),
    (
        "evaluate_huron13_5_axes",
        "  with capacities for five axes",
        0,
    ),
    (
        "evaluate_huron13_direction",
        "  for the direction of the tool",
        390,
    ),
    (
        "evaluate_kolibri10_direction",
        "  the same, 10 errors of the Kolibri",
        0,
    ),
    ("servo_update_huron13", "servo update: the same", 675),
    (
        "servo_update_huron13_5_axes",
        "  with capacities for five axes",
        0,
    ),
    ("servo_long_huron13", "servo update in a ramp", 0),
    (
        "servo_long_huron13_5_axes",
        "  with capacities for five axes",
        0,
    ),
    ("servo_fade_huron13", "servo update in a cross-fade", 0),
    (
        "servo_fade_huron13_5_axes",
        "  with capacities for five axes",
        0,
    ),
    (
        "servo_thermal_none",
        "servo update: one axis, three tables",
        0,
    ),
    ("servo_thermal_2", "  two of them over temperatures", 0),
    ("servo_thermal_2_lag", "  with a lag each", 0),
    ("grid25_3out", "evaluate: grid 25×25×25, three outputs", 205),
    ("document_40_tables", "evaluate: layout of 40 tables", 700),
    ("fik_huron13", "  by the scheme fik, 13 errors", 800),
    (
        "fik_huron13_5_weights",
        "  with five weights that can be set",
        0,
    ),
    ("linear_1_table", "evaluate: a bank of one linear table", 0),
    ("linear_9_tables", "  of nine", 0),
    ("cubic_1_table", "evaluate: a bank of one cubic table", 0),
    ("cubic_9_tables", "  of nine", 0),
    ("generated_huron13", "generated: 13 errors, five axes", 0),
    (
        "generated_huron13_direction",
        "  for the direction of the tool",
        200,
    ),
    (
        "generated_kolibri10_direction",
        "  the same, 10 errors of the Kolibri",
        350,
    ),
    ("generated_document_40_tables", "  layout of 40 tables", 350),
    ("rival_closed_form_libm", "instead: closed form, libm", 0),
    (
        "rival_closed_form_micromath",
        "instead: closed form, micromath",
        0,
    ),
    ("rival_htm_nalgebra", "instead: matrices, nalgebra f32", 0),
    (
        "rival_exact_correction",
        "instead: reference correction, f64, libm",
        0,
    ),
];
/// The figure that the rivals are compared with.
const OURS: &str = "evaluate_huron13";
/// Maximum instructions of any update of a kind.
const MOST: [(&str, u64); 2] = [("servo_long_huron13", 1250), ("servo_fade_huron13", 2280)];
/// Instructions of an update for each of two lags: key, and the updates with and without them.
const LAG: (&str, [&str; 2]) = ("servo_lag", ["servo_thermal_2_lag", "servo_thermal_2"]);
/// Maximum of it.
const LAG_MOST: u64 = 60;
/// Target for the cycles of the typical call.
const CYCLES: [(&str, u64); 3] = [
    ("evaluate_huron13", 665),
    ("servo_update_huron13", 1050),
    ("generated_huron13_direction", 320),
];
/// Maximum stack of any of our calls, bytes.
const STACK: u64 = 1024;
/// Maximum size of the code that runs in the servo loop, bytes.
const CODE: u64 = 16 * 1024;
/// Maximum flash including loading, bytes.
const FLASH: u64 = 34 * 1024;
/// Maximum flash of the whole firmware for the STM32F405, without tables, bytes: code and initial values.
const IMAGE: u64 = 72 * 1024;

/// # Errors
/// If something cannot be built or run, the servo path contains a panic, or a figure grew.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let accept = match options {
        [] => false,
        ["--accept"] => true,
        other => {
            let other = other.join(" ");
            return Err(format!("bench-target takes --accept, not `{other}`"));
        }
    };
    let cross = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    let folder = build(&cross)?;
    let (mut figures, mut costs) = measure(&folder.join("release/bench-target"))?;
    // Generated code and the rivals as fast as the compiler makes them; ours as the boards are built, for size.
    let (fast, fast_costs) = measure(&folder.join("fast/bench-target"))?;
    let is_fast = |key: &str| key.starts_with("rival_") || key.starts_with("generated_");
    costs.extend(fast_costs.into_iter().filter(|(key, _)| is_fast(key)));
    for (key, ..) in CALLS.iter().filter(|(key, ..)| is_fast(key)) {
        for key in ["", "_min", "_max", "_nm", "_cycles"].map(|end| format!("{key}{end}")) {
            if let Some(value) = fast.get(&key) {
                figures.set(&key, value);
            }
        }
    }
    let runtime = ElfProgram::read(&folder.join("release/runtime"))?;
    let mut wrong = Vec::new();
    for (root, key) in [
        ("evaluate", "code_evaluate"),
        ("update", "code_servo_update"),
    ] {
        let size = servo_path(&runtime, root, &mut wrong)?;
        figures.set(key, size.into());
    }
    figures.set("code_runtime", runtime.flash().into());
    let (key, updates) = LAG;
    let [with, without] = updates.map(|key| figures.get(key).unwrap_or(0));
    figures.set(key, with.saturating_sub(without) / 2);
    figures.set("image_stm32f405", image(&cross)?.into());

    print(&figures, &costs, &fast, &cross.version);
    // Includes its location without CARGO_TARGET_DIR.
    for folder in [target(""), files::folder(root().join("target"))?] {
        files::write(&folder.join("bench-target.json"), figures.to_json())?;
    }
    wrong.extend(compare(&figures, &cross.version, accept)?);
    judged(&wrong)?;
    println!("evaluate and servo update cannot reach a panic");
    Ok(())
}

/// Builds blobs and programs; returns the folder of the programs.
fn build(cross: &Cross) -> Result<PathBuf, String> {
    let blobs = files::folder(target("bench-blobs"))?;
    let trueaxis = trueaxis()?;
    let huron = ("huron-k2x8", "errors-13");
    let weights = "fik --adjust EX0S,EZ0S,EXX1,EYY1,EZZ1";
    for ((machine, errors), scheme, policy, blob) in [
        (huron, "exact", "orientation", "huron13"),
        (huron, "exact", "direction", "huron13-direction"),
        (huron, "fik", "orientation", "huron13-fik"),
        (huron, weights, "orientation", "huron13-fik-5"),
        (
            ("kolibri", "errors-10"),
            "exact",
            "direction",
            "kolibri10-direction",
        ),
    ] {
        let sources = ["machine", errors].map(|name| format!("examples/{machine}/{name}.toml"));
        let options = format!("--scheme {scheme} --policy {policy}");
        let blob = blobs.join(blob).with_extension("trax");
        blob::compile(&trueaxis, &sources, &options, &blob)?;
    }
    run(example("bench-blobs").current_dir(root()).arg(&blobs))?;
    for name in [
        "huron13",
        "huron13-direction",
        "kolibri10-direction",
        "document40",
    ] {
        let [blob, code] = ["trax", "rs"].map(|kind| blobs.join(name).with_extension(kind));
        let mut generate = Command::new(&trueaxis);
        run(generate.arg("generate").arg(blob).arg("-o").arg(code))?;
    }
    let build = |profile| {
        let words = format!("build -q --profile {profile} -p trueaxis-bench-target");
        let (mut command, folder) = cross.cargo("stm32f405", &words);
        run(command.env("TRUEAXIS_BENCH_BLOBS", &blobs)).map(|()| folder)
    };
    build("fast")?;
    build("release")
}

/// Flash size of the firmware for the STM32F405, bytes.
fn image(cross: &Cross) -> Result<u32, String> {
    let folder = cross.build("stm32f405", "build -q --release")?;
    Ok(ElfProgram::read(&folder.join("release/stm32f405"))?.flash())
}

/// Costs of the typical call of each kind, by key.
type Costs = BTreeMap<String, Cost>;

/// Runs the counting program, and once more with every instruction traced.
fn measure(program: &Path) -> Result<(Figures, Costs), String> {
    let mut figures = Figures::counted(program)?;
    let mut costs = Costs::new();
    for (key, calls) in trace::calls(program)? {
        let Some(typical) = figures.get(&key) else {
            return Err(format!("{key} is traced, but not counted"));
        };
        let off = |cost: &Cost| typical.abs_diff(cost.instructions.into());
        if let Some(nearest) = calls.into_iter().min_by_key(off) {
            figures.set(&format!("{key}_cycles"), nearest.cycles.into());
            costs.insert(key, nearest);
        }
    }
    Ok((figures, costs))
}

/// Size of the code reachable from `root`, bytes. None of it may panic, and none may call through a pointer, which this
/// check cannot follow.
fn servo_path(runtime: &ElfProgram, root: &str, wrong: &mut Vec<String>) -> Result<u32, String> {
    // `servo_path::ROOT` as mangled by the compiler.
    let reach = runtime.reach(&format!("10servo_path{}{root}", root.len()))?;
    wrong.extend(reach.faults(root));
    Ok(reach.size)
}

fn verdict(value: u64, most: u64) -> &'static str {
    if value <= most { "met" } else { "MISSED" }
}

fn print(figures: &Figures, costs: &Costs, fast: &Figures, version: &str) {
    let get = |key: &str| figures.get(key).unwrap_or(0);
    println!(
        "instructions per call on a Cortex-M4F (QEMU, rustc {version}), and the cycles of ARM's"
    );
    println!("reference manual for the typical call: a model, without wait states");
    println!(
        "{:<40} {:>7} {:>7} {:>7} {:>8} {:>15}  {:>6}",
        "", "least", "typical", "most", "cycles", "opt-level 3", "budget"
    );
    for (key, what, budget) in CALLS {
        let (typical, most) = (get(key), get(&format!("{key}_max")));
        let cycles = get(&format!("{key}_cycles"));
        print!(
            "{what:<40} {:>7} {typical:>7} {most:>7} {cycles:>8}",
            get(&format!("{key}_min")),
        );
        let fast = |key: &str| fast.get(key).unwrap_or(0);
        print!(" {:>6} / {:>6}", fast(key), fast(&format!("{key}_cycles")));
        if budget > 0 {
            print!("  {budget:>6} {}", verdict(typical, budget));
        } else if let Some((_, budget)) = MOST.iter().find(|(of, _)| *of == key) {
            print!("  {budget:>6} {} at most", verdict(most, *budget));
        } else if key.starts_with("rival_") {
            let off = get(&format!("{key}_nm")) as f64 / 1000.0;
            let times = typical as f64 / get(OURS) as f64;
            print!("  {times:>5.1} × evaluate, off by {off:.3} µm or 0.001°");
        }
        if let Some((_, budget)) = CYCLES.iter().find(|(of, _)| *of == key) {
            print!(", {budget} cycles {}", verdict(cycles, *budget));
        }
        println!();
    }
    println!(
        "most of a servo update: where axes reverse. Built for size; generated code and rivals for speed."
    );
    println!(
        "the lag of a temperature: {} instructions of an update, {LAG_MOST} {}",
        get(LAG.0),
        verdict(get(LAG.0), LAG_MOST),
    );
    let of = |key| costs.get(key).cloned().unwrap_or_default();
    shares(&CYCLES.map(|(key, _)| (key, of(key))));
    println!("\nbytes");
    let stacks = CALLS
        .iter()
        .filter_map(|(key, ..)| figures.get(&format!("stack_{key}")));
    let bytes = [
        ("stack of a call, most", stacks.max().unwrap_or(0), STACK),
        ("code that evaluate reaches", get("code_evaluate"), 0),
        (
            "code that servo update reaches",
            get("code_servo_update"),
            CODE,
        ),
        (
            "flash with loading, start-up and data",
            get("code_runtime"),
            FLASH,
        ),
        (
            "firmware of the STM32F405, no tables",
            get("image_stm32f405"),
            IMAGE,
        ),
    ];
    for (what, value, budget) in bytes {
        print!("{what:<40} {:>23}", value);
        if budget > 0 {
            print!("  {budget:>6} {}", verdict(value, budget));
        }
        println!();
    }
    println!();
}

/// Distribution of the cycles of several calls over the kinds of instructions.
fn shares(calls: &[(&str, Cost)]) {
    let line = |name: &str, value: &dyn Fn(&Cost) -> String| {
        print!("{name:<40}");
        for (_, cost) in calls {
            print!(" {:>22}", value(cost));
        }
        println!();
    };
    print!("\n{:<40}", "cycles (instructions)");
    calls.iter().for_each(|(key, _)| print!(" {key:>22}"));
    println!();
    for kind in instruction::InstructionKind::ALL {
        line(kind.name(), &|cost| {
            let (count, cycles) = cost.kinds.get(&kind).copied().unwrap_or_default();
            format!("{cycles} ({count})")
        });
    }
    line("all", &|cost| {
        format!("{} ({})", cost.cycles, cost.instructions)
    });
    line("of them after taken branches", &|cost| {
        cost.refills.to_string()
    });
    line("of them for floating-point results", &|cost| {
        cost.waits.to_string()
    });
}

/// Compares with the committed figures of the same compiler, or commits the new ones; returns the problems.
fn compare(figures: &Figures, version: &str, accept: bool) -> Result<Vec<String>, String> {
    let release = version
        .rsplit_once('.')
        .map_or(version, |(release, _)| release);
    let folder = root().join("firmware/boards/stm32f405/bench/figures");
    let path = folder.join(format!("rustc-{release}.json"));
    let shown = path.strip_prefix(root()).unwrap_or(&path).display();
    if accept {
        files::write(&path, figures.to_json())?;
        println!("{shown} has these figures now");
        return Ok(Vec::new());
    }
    // Other compilers give other figures, by up to a tenth, so each has its own.
    let Ok(text) = fs::read_to_string(&path) else {
        println!("no committed figures of rustc {release} to compare with (--accept makes them)");
        return Ok(Vec::new());
    };
    // Limits also apply to compilers with known figures.
    let typical = CALLS
        .iter()
        .map(|(key, _, budget)| (key.to_string(), *budget));
    let stacks = CALLS
        .iter()
        .map(|(key, ..)| (format!("stack_{key}"), STACK));
    let most = MOST
        .iter()
        .map(|(key, budget)| (format!("{key}_max"), *budget));
    let cycles = CYCLES
        .iter()
        .map(|(key, budget)| (format!("{key}_cycles"), *budget));
    let code = [
        (LAG.0, LAG_MOST),
        ("code_servo_update", CODE),
        ("code_runtime", FLASH),
        ("image_stm32f405", IMAGE),
    ];
    let code = code.map(|(key, budget)| (key.to_owned(), budget));
    let over: Vec<String> = typical
        .chain(most)
        .chain(stacks)
        .chain(cycles)
        .chain(code)
        .filter_map(|(key, budget)| {
            let value = figures.get(&key)?;
            (budget > 0 && value > budget)
                .then(|| format!("{key}: {value} is over its budget of {budget}"))
        })
        .collect();
    let mut grown = figures.grown(&Figures::from_json(&text), GROWTH);
    if grown.is_empty() {
        println!("no figure is more than {GROWTH} % above {shown}");
    } else {
        grown.push(format!("against {shown}; --accept takes them"));
    }
    grown.extend(over);
    Ok(grown)
}
