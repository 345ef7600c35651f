//! The panel in LinuxCNC's screen AXIS, on a screen that nobody sees: its buttons are pressed with the mouse, and what it
//! shows is compared with the pins. Makes the picture of the manual.

use super::bench::LinuxCncBench;
use super::motion::example;
use crate::files;
use crate::packages;
use crate::process::{has, root, run, target, works};
use std::process::Command;

const CONFIGS: &str = "firmware/linuxcnc/configs";
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
                       axis-remote --quit; timeout 30 tail --pid=$linuxcnc -f /dev/null || { echo 'LinuxCNC does not end'; code=1; }\n\
                       cat linuxcnc.log; echo \"code $code\"\n";
/// The last calibration, as the manual has it.
const VALIDATION: &str = "{\"probings\": 10, \"before\": {\"rms_um\": 39.18, \"largest_um\": 61.2}, \
                          \"after\": {\"rms_um\": 1.68, \"largest_um\": 3.1}, \"probing_um\": 2.0, \"coverage_um\": 4.24, \
                          \"expected_um\": 6.1, \"is_kept\": true}";

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    if !(works(Command::new("xvfb-run").arg("--help")) && has("xdotool") && has("import")) {
        packages::install(&["xvfb", "xdotool", "imagemagick"], "the test of the panel")?;
    }
    let bench = bench.apart("panel")?;
    let trueaxis = bench.program()?;
    for (from, to) in [
        (CONFIGS, "configs"),
        ("firmware/linuxcnc/panel", "installed"),
    ] {
        run(Command::new("cp")
            .args(["-r", "-T"])
            .arg(root().join(from))
            .arg(bench.file(to)))?;
    }
    for name in ["panel_probe.py", "panel_driver.py"] {
        bench.copy(&format!("firmware/linuxcnc/tests/{name}"), name)?;
    }
    let file = |name: &str| format!("{FOLDER}/{name}");
    let ini = files::read_text(&bench.file(&file("xyzac-trt.ini")))?;
    let probed = format!("-u {INSTALLED}trueaxis_panel.py -u /tmp/panel_probe.py");
    let ini = ini
        .lines()
        .filter(|line| !line.starts_with("PYVCP") && !line.starts_with("POSTGUI"))
        .collect::<Vec<_>>()
        .join("\n")
        .replace("OPEN_FILE", "USER_COMMAND_FILE = /tmp/axis.py\nOPEN_FILE")
        .replace(&format!("-u {INSTALLED}trueaxis_panel.py"), &probed)
        .replace(INSTALLED, "/tmp/installed/")
        .replace("CALIBRATE = trueaxis", &format!("CALIBRATE = {trueaxis}"))
        .replace("../../../../examples/linuxcnc-xyzac-trt/", "");
    bench.write(&file("xyzac-trt.ini"), ini + "\n")?;
    bench.write("axis.py", AXIS)?;
    bench.write("operate", OPERATE)?;
    let (machine, errors) = (example("machine.toml"), example("errors-11.toml"));
    files::copy(machine.as_ref(), &bench.file(&file("machine.toml")))?;
    let compile = |tolerance: &str, name: &str| {
        bench.trueaxis(&[
            "compile",
            &machine,
            &errors,
            "--tolerance",
            tolerance,
            "-o",
            &file(name),
            "--random",
            "1000",
        ])
    };
    compile("0.05", "xyzac-trt.trax")?;
    compile("1", "coarse.trax")?;
    files::copy(
        &bench.file(&file("xyzac-trt.trax")),
        &bench.file(&file("fine.trax")),
    )?;
    let mut damaged = files::read(&bench.file(&file("fine.trax")))?;
    if let Some(last) = damaged.last_mut() {
        *last ^= 1;
    }
    bench.write(&file("damaged.trax"), damaged)?;
    bench.trueaxis(&[
        "linuxcnc",
        "model",
        &machine,
        &errors,
        "-o",
        &file("xyzac-trt.model"),
    ])?;
    bench.write(
        "bounds.json",
        bench.trueaxis(&["inspect", &file("fine.trax"), "--json"])?,
    )?;
    files::folder(bench.file(&file("calibration-2026-05-04-091200")))?;
    bench.write(
        &file("calibration-2026-05-04-091200/validation.json"),
        VALIDATION,
    )?;
    run(Command::new("touch")
        .args(["-d", "2026-05-04 09:12"])
        .arg(bench.file(&file("calibration-2026-05-04-091200/validation.json"))))?;
    run(Command::new("chmod")
        .args(["-R", "a+rwX"])
        .arg(bench.file("configs")))?;
    let said = bench.inside(&["sh", "/tmp/operate"])?;
    if !said.contains("the panel shows what the pins have") || !said.ends_with("code 0\n") {
        return Err(said);
    }
    let picture = target(PICTURE);
    files::copy(&bench.file("panel.png"), &picture)?;
    println!("panel: as the pins; {}", picture.display());
    Ok(())
}
