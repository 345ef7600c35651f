//! A surface that LinuxCNC probes becomes a map of Z over X and Y, is added to the compensation in use, and is loaded
//! while the corrections are on. Probed again, the surface is flat; with the corrections off, it is what it was.

use super::bench::LinuxCncBench;
use super::three_axes::ThreeAxes;
use programs::{csv, files};

const FOLDER: &str = "surface";
const MACHINE: ThreeAxes = ThreeAxes {
    name: FOLDER,
    play: 0.0,
    home: Some(0.0),
};
/// A probing stops within two periods of a millisecond after the contact, at 0.5 mm/s; LinuxCNC logs six digits.
const TOLERANCE: f64 = 1e-3 + 2e-6;
/// Height of the surface over the machine's Z = −20 at machine positions: constant, per mm of X, per mm of Y, per mm²
/// of both.
const SURFACE: [f64; 4] = [-0.05, 2e-3, -1e-3, 1e-5];
/// The work offset of `surface.py`.
const OFFSET: [f64; 3] = [30.0, 20.0, -20.0];
/// Errors whose correction of Z is linear, so that the map repeats it between its points.
const ERRORS: &str = "machine = \"surface\"\n[parameters]\nEXX1 = 50e-6\nEZX1 = 40e-6\n";

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    MACHINE.set_up(bench)?;
    compile(bench)?;
    let said = MACHINE.run(bench, &surface())?;
    let largest = |name: &str, count: usize, height: &dyn Fn(f64, f64) -> f64| {
        let rows = points(bench, name).map_err(|e| format!("{e}\n{said}"))?;
        if rows.len() != count {
            return Err(format!("{name} has {} points\n{said}", rows.len()));
        }
        let off = rows
            .iter()
            .map(|row| (row[2] - height(row[0], row[1])).abs());
        Ok(off.fold(0.0_f64, f64::max))
    };
    // Before, the correction of Z is in the heights, up to 6 µm.
    let relief = largest("points.txt", 12, &|_, _| 0.0)?;
    let after = largest("after.txt", 4, &|_, _| 0.0)?;
    let off = largest("off.txt", 4, &height)?;
    println!(
        "surface: heights up to {:.0} µm are {:.2} µm with the map; with the corrections off the surface is found \
         to {:.2} µm",
        relief * 1e3,
        after * 1e3,
        off * 1e3
    );
    match relief > 0.1 && after <= TOLERANCE && off <= TOLERANCE {
        true => Ok(()),
        false => Err(format!("more than {:.2} µm\n{said}", TOLERANCE * 1e3)),
    }
}

/// Height of the surface at a position of the program.
fn height(x: f64, y: f64) -> f64 {
    let [c, a, b, ab] = SURFACE;
    let (x, y) = (x + OFFSET[0], y + OFFSET[1]);
    c + a * x + b * y + ab * x * y
}

/// The points that a probing has logged.
fn points(bench: &LinuxCncBench, name: &str) -> Result<Vec<Vec<f64>>, String> {
    let text = files::read_text(&bench.file(&format!("{FOLDER}/{name}")))?;
    // The log has no header, and spaces between its numbers.
    let text = format!("x,y,z,a,b,c,u,v,w\n{}", text.trim_end().replace(' ', ","));
    csv::numbers(&text)
}

/// The compensation that has no map yet, and what the program needs to add one.
fn compile(bench: &LinuxCncBench) -> Result<(), String> {
    bench.program()?;
    let [errors, machine, trax, geometry] = [
        "errors.toml",
        "new/machine.toml",
        "new/machine.trax",
        "geometry.trax",
    ]
    .map(|name| format!("{FOLDER}/{name}"));
    bench.write(&errors, ERRORS)?;
    bench.compile(&machine, &errors, &trax, &[])?;
    files::copy(&bench.file(&trax), &bench.file(&geometry))
}

/// The probe trips where the drives are at the surface. The program switches the corrections: M64 P0 and M65 P0.
fn surface() -> String {
    let [c, a, b, ab] = SURFACE;
    format!(
        "loadrt sum2 count=2\nloadrt mult2\nloadrt comp\n\
         net drive-0 => sum2.0.in0 mult2.0.in0\nnet drive-1 => sum2.0.in1 mult2.0.in1\n\
         setp sum2.0.gain0 {a}\nsetp sum2.0.gain1 {b}\nsetp sum2.0.offset {}\n\
         net plane sum2.0.out => sum2.1.in0\nnet product mult2.0.out => sum2.1.in1\nsetp sum2.1.gain1 {ab}\n\
         net surface sum2.1.out => comp.0.in1\nnet drive-2 => comp.0.in0\nsetp comp.0.hyst 0\n\
         net touched comp.0.out => motion.probe-input\n\
         addf mult2.0 servo-thread\naddf sum2.0 servo-thread\naddf sum2.1 servo-thread\naddf comp.0 servo-thread\n\
         net compensate motion.digital-out-00 => trueaxis.enable\n",
        c + OFFSET[2]
    )
}
