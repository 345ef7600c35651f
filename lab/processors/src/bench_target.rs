//! Instructions on an emulated Cortex-M4F, code size and stack.

mod budgets;
mod built;

use budgets::{CODE, FLASH, IMAGE, LAG, LAG_MOST, MOST, OURS, STACK, calls};
use lab_processors::cross::{CORTEX_M, Cross};
use lab_processors::elf::ElfProgram;
use lab_processors::figures::Figures;
use lab_processors::qemu;
use programs::files;
use programs::process::{judged, root, target};
use std::fs;

/// Permitted growth of a figure over the committed one, per cent.
const GROWTH: u64 = 5;

/// Counts, prints and compares; with `accept`, the figures become those that later ones are compared with.
///
/// # Errors
/// If something cannot be built or run, the servo path contains a panic, or a figure grew.
pub fn check(accept: bool) -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    let folder = built::programs(&cross)?;
    let mut figures = Figures::counted(&folder.join("release/bench-target"))?;
    // Generated code and the rivals as fast as the compiler makes them; ours as the boards are built, for size.
    let fast = Figures::counted(&folder.join("fast/bench-target"))?;
    let is_fast = |key: &str| key.starts_with("rival_") || key.starts_with("generated_");
    for (key, ..) in calls().filter(|(key, ..)| is_fast(key)) {
        for key in ["", "_min", "_max", "_nm"].map(|end| format!("{key}{end}")) {
            if let Some(value) = fast.get(&key) {
                figures.set(&key, value);
            }
        }
    }
    let (key, updates) = LAG;
    let [with, without] = updates.map(|key| figures.get(key).unwrap_or(0));
    figures.set(key, with.saturating_sub(without) / 2);
    let mut wrong = sizes(
        &cross,
        &ElfProgram::read(&folder.join("release/runtime"))?,
        &mut figures,
    )?;

    print(&figures, &fast, &cross.version);
    // Includes its location without CARGO_TARGET_DIR.
    for folder in [target(""), files::folder(root().join("target"))?] {
        files::write(&folder.join("bench-target.json"), figures.to_json())?;
    }
    wrong.extend(compare(&figures, &cross.version, accept)?);
    judged(&wrong)?;
    println!("evaluate and servo update cannot reach a panic");
    Ok(())
}

/// Adds the sizes of code; returns what the servo path reaches and must not.
fn sizes(
    cross: &Cross,
    runtime: &ElfProgram,
    figures: &mut Figures,
) -> Result<Vec<String>, String> {
    let mut wrong = Vec::new();
    for (root, key) in [
        ("evaluate", "code_evaluate"),
        ("update", "code_servo_update"),
    ] {
        // `servo_path::ROOT` as mangled by the compiler.
        let reach = runtime.reach(&format!("10servo_path{}{root}", root.len()))?;
        wrong.extend(reach.faults(root));
        figures.set(key, reach.size.into());
    }
    figures.set("code_runtime", runtime.flash().into());
    figures.set("image_stm32f405", built::image(cross)?.into());
    Ok(wrong)
}

fn verdict(value: u64, most: u64) -> &'static str {
    if value <= most { "met" } else { "MISSED" }
}

fn print(figures: &Figures, fast: &Figures, version: &str) {
    println!("instructions per call on a Cortex-M4F (QEMU, rustc {version})");
    println!(
        "{:<40} {:>7} {:>7} {:>7} {:>11}  {:>6}",
        "", "least", "typical", "most", "opt-level 3", "budget"
    );
    for (key, what, budget) in calls() {
        print_call(figures, fast.get(key).unwrap_or(0), key, what, budget);
    }
    println!(
        "most of a servo update: where axes reverse. Built for size; generated code and rivals for speed."
    );
    let lag = figures.get(LAG.0).unwrap_or(0);
    println!(
        "the lag of a temperature: {lag} instructions of an update, {LAG_MOST} {}",
        verdict(lag, LAG_MOST),
    );
    print_bytes(figures);
}

/// Prints the instructions of a kind of call, beside those of the build for speed.
fn print_call(figures: &Figures, fast: u64, key: &str, what: &str, budget: u64) {
    let get = |end: &str| figures.get(&format!("{key}{end}")).unwrap_or(0);
    let (least, typical, most) = (get("_min"), get(""), get("_max"));
    print!("{what:<40} {least:>7} {typical:>7} {most:>7} {fast:>11}");
    if budget > 0 {
        print!("  {budget:>6} {}", verdict(typical, budget));
    } else if let Some((_, budget)) = MOST.iter().find(|(of, _)| *of == key) {
        print!("  {budget:>6} {} at most", verdict(most, *budget));
    } else if key.starts_with("rival_") {
        let off = get("_nm") as f64 / 1000.0;
        let times = typical as f64 / figures.get(OURS).unwrap_or(0) as f64;
        print!("  {times:>5.1} × evaluate, off by {off:.3} µm or 0.001°");
    }
    println!();
}

fn print_bytes(figures: &Figures) {
    let get = |key: &str| figures.get(key).unwrap_or(0);
    let stacks = calls().filter_map(|(key, ..)| figures.get(&format!("stack_{key}")));
    println!("\nbytes");
    for (what, value, budget) in [
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
    ] {
        print!("{what:<40} {value:>23}");
        if budget > 0 {
            print!("  {budget:>6} {}", verdict(value, budget));
        }
        println!();
    }
    println!();
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
    let mut wrong = figures.grown(&Figures::from_json(&text), GROWTH);
    if wrong.is_empty() {
        println!("no figure is more than {GROWTH} % above {shown}");
    } else {
        wrong.push(format!("against {shown}; --accept takes them"));
    }
    // Limits also apply to compilers with known figures.
    wrong.extend(budgets::limits().into_iter().filter_map(|(key, budget)| {
        let value = figures.get(&key)?;
        (budget > 0 && value > budget)
            .then(|| format!("{key}: {value} is over its budget of {budget}"))
    }));
    Ok(wrong)
}
