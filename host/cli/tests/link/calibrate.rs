//! `trueaxis calibrate` with a board: the machine's own controller probes, and its logs arrive as files.

use crate::command::{has, says};
use crate::served::Served;
use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::{Duration, Instant};
use trueaxis::link::Slot;
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::mock_flash::MockFlash;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{self, Probing, Probings};
use trueaxis_identify::simulate::{Disturbances, corrections};
use trueaxis_link::{Client, LinkedController, Tcp};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::Runtime;
use trueaxis_probing::plan::{Probe, simulated_touches, touch_log};
use trueaxis_probing::probe_file::Spherical;

/// What a calibration takes longest for (s).
const LONGEST: Duration = Duration::from_secs(120);

struct Shop {
    folder: tempfile::TempDir,
    machine: Machine,
    artefact: Artefact,
    errors: ErrorModel,
    served: Served,
}

impl Shop {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let example = |name: &str| {
            let at = format!(
                "{}/../../examples/linuxcnc-xyzac-trt/{name}",
                env!("CARGO_MANIFEST_DIR")
            );
            fs::read_to_string(at).unwrap()
        };
        let (machine, artefact) = (example("machine.toml"), example("artefact.toml"));
        fs::write(folder.path().join("machine.toml"), &machine).unwrap();
        fs::write(folder.path().join("artefact.toml"), &artefact).unwrap();
        let machine = Machine::from_toml(&machine).unwrap();
        // Balls are touched from both sides, which hides the backlash of a linear axis.
        let errors = example("errors-11.toml").replace("EXXb", "# EXXb");
        let flash = MockFlash::new(400).with_while_busy(WhileBusy::DualBank);
        Self {
            artefact: Artefact::from_toml(&artefact, machine.tool_axis).unwrap(),
            errors: ErrorModel::from_toml(&errors, &machine).unwrap(),
            machine,
            folder,
            served: Served::moving(Desktop::start(flash, 0.001), [0.0; 8]),
        }
    }

    fn at(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// Starts the command.
    fn calibrate(&self, more: &[&str]) -> Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
        command.args([
            "calibrate",
            &self.at("machine.toml"),
            "--artefact",
            &self.at("artefact.toml"),
        ]);
        command.args([
            "--port",
            &self.served.port,
            "--folder",
            &self.at("run"),
            "--yes",
        ]);
        command.args([
            "--ball-diameter",
            "20",
            "--stylus-diameter",
            "6",
            "--validate",
            "6",
        ]);
        command.args([
            "--model",
            "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EYY1,EZZ1,ECCb,EX0C,EY0A",
        ]);
        command.args([
            "--probings",
            "32",
            "--indexings",
            "A=-60:60:20,C=-180:150:30",
        ]);
        // It has the only connection to the board.
        let said = fs::File::create(self.at("said")).unwrap();
        command.args(more).stdout(said.try_clone().unwrap());
        command.stderr(said);
        command.spawn().unwrap()
    }

    /// What the command has said.
    fn said(&self) -> String {
        fs::read_to_string(self.at("said")).unwrap()
    }

    /// Waits until the command wants touches with the corrections on.
    fn until_validation(&self, child: &mut Child) {
        wait(|| {
            let wants = self.said().contains("run/after.csv\n");
            assert!(
                wants || child.try_wait().unwrap().is_none(),
                "{}",
                self.said()
            );
            wants
        });
    }

    /// Exit code, and what it said.
    fn ended(&self, mut child: Child) -> (Option<i32>, String) {
        (child.wait().unwrap().code(), self.said())
    }

    /// Probes a plan, with a compensation on, into a log.
    fn probe(&self, plan: &str, log: &str, blob: Option<&str>) {
        wait(|| Path::new(&self.at(plan)).exists());
        let text = fs::read_to_string(self.at(plan)).unwrap();
        let plan = probings::read(&text, &self.machine, false).unwrap();
        let touches = self.touches(&plan, blob);
        let text = touch_log(&self.machine, &touches);
        let partial = self.at("partial");
        fs::write(&partial, text).unwrap();
        fs::rename(partial, self.at(log)).unwrap();
    }

    /// Commands at which the tip touches.
    fn touches(&self, plan: &Probings, blob: Option<&str>) -> Vec<PerAxis> {
        let machine = &self.machine;
        let noise = Disturbances {
            noise: 3e-4,
            ..Disturbances::default()
        };
        let kinematics = Kinematics::new(machine, &self.errors);
        let (artefact, probe) = (&self.artefact, Probe::default());
        let lobing = Spherical::default();
        let found = simulated_touches(
            &kinematics,
            artefact,
            artefact,
            plan,
            &probe,
            &lobing,
            &noise,
        );
        let mut touches = found.unwrap();
        let Some(blob) = blob else { return touches };
        let blob = trueaxis::AlignedBlob::from_bytes(&fs::read(self.at(blob)).unwrap());
        let runtime = Runtime::load(&blob).unwrap();
        for real in &mut touches {
            // The axes are where they were, at other commands: corrections change by a thousandth of a correction.
            let mut row = Probing {
                position: *real,
                ..plan.rows[0].clone()
            };
            for _ in 0..4 {
                let dq = corrections(machine, &runtime, &[row.clone()])[0];
                row.position = std::array::from_fn(|i| real[i] - dq[i]);
            }
            *real = row.position;
        }
        touches
    }

    fn controller(&self) -> LinkedController {
        let address = self.served.port.strip_prefix("tcp:").unwrap();
        Client::connect(Tcp::open(address).unwrap()).unwrap().1
    }

    /// The slot in use, its checksum, and whether the corrections are on.
    fn state(&self) -> (Option<Slot>, String, String) {
        let controller = self.controller();
        let slot = controller
            .active
            .map(|slot| controller.slots[slot.index()].state);
        let shown = says(0, &format!("control --port {} show", self.served.port));
        let words = ["corrections enabled, in", "corrections disabled, out"].into_iter();
        let on = words.filter(|word| shown.contains(word)).collect();
        (controller.active, format!("{slot:?}"), on)
    }
}

fn wait(mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < LONGEST);
        sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_board_gets_what_is_right_and_goes_on_as_before_otherwise() {
    let shop = Shop::new();
    // Before: another compensation, which is not on.
    fs::write(
        shop.at("before.toml"),
        "machine = \"xyzac-trt\"\n[parameters]\nEC0X = 5e-6\n",
    )
    .unwrap();
    let [machine, before, blob] =
        ["machine.toml", "before.toml", "before.trax"].map(|name| shop.at(name));
    says(0, &format!("compile {machine} {before} -o {blob}"));
    says(
        0,
        &format!("flash {blob} --port {} --activate", shop.served.port),
    );
    let as_found = shop.state();
    let child = shop.calibrate(&[]);
    shop.probe("run/validation.csv", "run/before.csv", None);
    shop.probe("run/plan.csv", "run/touches.csv", None);
    // Without a bar nothing shows the scale of X, and the balls do not tell errors that the stylus takes up.
    let (code, said) = shop.ended(child);
    assert_eq!(code, Some(1), "{said}");
    let parts = [
        "nothing is loaded: ",
        "EXX1",
        "are not measured",
        "--accept-missing",
    ];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    // The same touches with another stylus than stated.
    let text = fs::read_to_string(&machine).unwrap();
    let other = text.replace("tip_mm = [0.0, 0.0", "tip_mm = [0.3, 0.0");
    assert_ne!(text, other);
    fs::write(&machine, other).unwrap();
    let (code, said) = shop.ended(shop.calibrate(&["--from", "identify", "--accept-missing"]));
    assert_eq!(code, Some(1), "{said}");
    has(&said, "nothing is loaded: the stylus is 0.");
    fs::write(&machine, text).unwrap();
    assert_eq!(shop.state(), as_found);
    let mut child = shop.calibrate(&["--from", "identify", "--accept-missing"]);
    shop.until_validation(&mut child);
    shop.probe(
        "run/validation.csv",
        "run/after.csv",
        Some("run/machine.trax"),
    );
    let (code, said) = shop.ended(child);
    assert_eq!(code, Some(0), "{said}");
    has(&said, "is in use, and switched on");
    let calibrated = shop.state();
    assert_ne!(calibrated, as_found);
    // The same files again, but nothing of it reaches the machine: the tables of the first time are in use again.
    says(
        0,
        &format!(
            "compile {machine} {} --tolerance 3 -o {}",
            shop.at("run/errors.toml"),
            shop.at("run/machine.trax")
        ),
    );
    let mut child = shop.calibrate(&["--from", "load", "--accept-missing"]);
    shop.until_validation(&mut child);
    shop.probe("run/validation.csv", "run/after.csv", None);
    let (code, said) = shop.ended(child);
    assert_eq!(code, Some(1), "{said}");
    has(&said, "the machine is not better than before");
    assert_eq!(shop.state(), calibrated);
    // Killed while it waits for the touches: its shell puts them back.
    let mut child = shop.calibrate(&["--from", "load", "--accept-missing"]);
    shop.until_validation(&mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    // Its own connections come one after the other; a look must not be between them.
    sleep(Duration::from_secs(3));
    wait(|| shop.state() == calibrated);
    shop.served.take();
}
