//! The panel in LinuxCNC's screen AXIS, on a screen that nobody sees: its buttons are pressed with the mouse, and what
//! it shows is compared with the pins. Makes the picture of the manual.

use super::bench::{LinuxCncBench, without_panels};
use super::motion::example;
use programs::process::{has, run, target, works};
use programs::{files, packages};
use std::process::Command;

const FOLDER: &str = "configs/xyzac-trt";
/// Where the panel is installed, as `setup` writes it.
const INSTALLED: &str = "/usr/share/trueaxis/";
/// The picture, in the target folder.
pub const PICTURE: &str = "linuxcnc-panel.png";
/// What AXIS runs when it starts: the tab is in front, in a window of the size of the picture.
const AXIS: &str = "root_window.tk.call('wm', 'geometry', '.', '1100x760')\n\
                    def to_front():\n    \
                        root_window.tk.call(pane_top + '.right', 'raise', 'user_0')\n    \
                        open('/tmp/in-front', 'w').close()\n\
                    root_window.after(3000, to_front)\n";
/// Xvfb, LinuxCNC and the operator; AXIS ends LinuxCNC.
const OPERATE: &str = "Xvfb :9 -screen 0 1280x800x24 -nolisten tcp 2>/dev/null &\n\
                       export DISPLAY=:9\n\
                       until xdotool getmouselocation >/dev/null 2>&1; do sleep 0.1; done\n\
                       linuxcnc /tmp/configs/xyzac-trt/xyzac-trt.ini > linuxcnc.log 2>&1 & linuxcnc=$!\n\
                       /usr/bin/python3 panel_driver.py; code=$?\n\
                       axis-remote --quit; timeout 30 tail --pid=$linuxcnc -f /dev/null \
                       || { echo 'LinuxCNC does not end'; code=1; }\n\
                       cat linuxcnc.log; echo \"code $code\"\n";
/// The last calibration, as the manual has it.
const VALIDATION: &str = "{\"probings\": 10, \"before\": {\"rms_um\": 39.18, \"largest_um\": 61.2}, \
                          \"after\": {\"rms_um\": 1.68, \"largest_um\": 3.1}, \"probing_um\": 2.0, \
                          \"coverage_um\": 4.24, \"expected_um\": 6.1, \"is_kept\": true}";

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    if !(works(Command::new("xvfb-run").arg("--help")) && has("xdotool") && has("import")) {
        packages::install(&["xvfb", "xdotool", "imagemagick"], "the test of the panel")?;
    }
    let bench = bench.apart("panel")?;
    configure(&bench)?;
    compensations(&bench)?;
    calibrated(&bench)?;
    bench.open_to_all("configs")?;
    let said = bench.inside(&["sh", "/tmp/operate"])?;
    if !said.contains("the panel shows what the pins have") || !said.ends_with("code 0\n") {
        return Err(said);
    }
    let picture = target(PICTURE);
    files::copy(&bench.file("panel.png"), &picture)?;
    println!("panel: as the pins; {}", picture.display());
    Ok(())
}

/// A file of the configuration.
fn file(name: &str) -> String {
    format!("{FOLDER}/{name}")
}

/// The configuration with the panel of this checkout, and what operates it.
fn configure(bench: &LinuxCncBench) -> Result<(), String> {
    let trueaxis = bench.program()?;
    bench.configurations()?;
    bench.copy_folder("firmware/linuxcnc/panel", "installed")?;
    for name in ["panel_probe.py", "panel_driver.py"] {
        bench.copy(&format!("firmware/linuxcnc/tests/{name}"), name)?;
    }
    let ini = file("xyzac-trt.ini");
    let probed = format!("-u {INSTALLED}trueaxis_panel.py -u /tmp/panel_probe.py");
    let text = without_panels(&files::read_text(&bench.file(&ini))?)
        .replace("OPEN_FILE", "USER_COMMAND_FILE = /tmp/axis.py\nOPEN_FILE")
        .replace(&format!("-u {INSTALLED}trueaxis_panel.py"), &probed)
        .replace(INSTALLED, "/tmp/installed/")
        .replace("CALIBRATE = trueaxis", &format!("CALIBRATE = {trueaxis}"))
        .replace("../../../../examples/linuxcnc-xyzac-trt/", "");
    bench.write(&ini, text)?;
    bench.write("axis.py", AXIS)?;
    bench.write("operate", OPERATE)
}

/// The compensation in use, a coarse one and a damaged one, and the simulated machine.
fn compensations(bench: &LinuxCncBench) -> Result<(), String> {
    let (machine, errors) = (example("machine.toml"), example("errors-11.toml"));
    files::copy(machine.as_ref(), &bench.file(&file("machine.toml")))?;
    let compile = |tolerance: &str, name: &str| {
        bench.compile(&machine, &errors, &file(name), &["--tolerance", tolerance])
    };
    compile("0.05", "xyzac-trt.trax")?;
    compile("1", "coarse.trax")?;
    let fine = bench.file(&file("fine.trax"));
    files::copy(&bench.file(&file("xyzac-trt.trax")), &fine)?;
    let mut damaged = files::read(&fine)?;
    if let Some(last) = damaged.last_mut() {
        *last ^= 1;
    }
    bench.write(&file("damaged.trax"), damaged)?;
    bench.model(&machine, &errors, &file("xyzac-trt.model"))?;
    let bounds = bench.trueaxis(&["inspect", &file("fine.trax"), "--json"])?;
    bench.write("bounds.json", bounds)
}

/// The files of the last calibration.
fn calibrated(bench: &LinuxCncBench) -> Result<(), String> {
    let folder = file("calibration-2026-05-04-091200");
    files::folder(bench.file(&folder))?;
    let validation = format!("{folder}/validation.json");
    bench.write(&validation, VALIDATION)?;
    run(Command::new("touch")
        .args(["-d", "2026-05-04 09:12"])
        .arg(bench.file(&validation)))
}
