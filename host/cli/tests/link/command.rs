//! The command, as a user runs it.

use crate::served::Served;
use crate::specimen::{adjustable, blob};
use std::process::{Command, Output};
use tempfile::TempDir;
use trueaxis::link::{Activation, Request, Slot};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::mock_flash::{Defect, MockFlash};
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_link::{Client, Tcp};
use trueaxis_tables::target::Target;

const PERIOD: f32 = 0.001;

pub fn desktop(while_busy: WhileBusy) -> Desktop {
    Desktop::start(MockFlash::new(96).with_while_busy(while_busy), PERIOD)
}

/// Runs the command with these words.
pub fn trueaxis(words: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueaxis"))
        .args(words.split_whitespace())
        .output()
        .unwrap()
}

/// Runs the command; returns both outputs with single spaces. Checks that it exits with `code`.
#[track_caller]
pub fn says(code: i32, words: &str) -> String {
    let output = trueaxis(words);
    let both = [output.stdout, output.stderr].concat();
    let text = String::from_utf8(both).unwrap();
    let words = text.split_whitespace().filter(|w| *w != "│");
    let text = words.collect::<Vec<_>>().join(" ");
    assert_eq!(output.status.code(), Some(code), "{text}");
    text
}

#[track_caller]
pub fn has(text: &str, part: &str) {
    assert!(text.contains(part), "`{part}` is not in\n{text}");
}

pub struct Files(TempDir);

impl Files {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, machine, axes, scale) in [
            ("first", "m", b"XY", 0.1),
            ("second", "m", b"XY", 0.2),
            ("other-name", "n", b"XY", 0.1),
            ("other-axes", "m", b"XZ", 0.1),
        ] {
            let blob = blob(machine, axes, scale, 1000);
            std::fs::write(folder.path().join(name), &*blob).unwrap();
        }
        std::fs::write(folder.path().join("adjustable"), &*adjustable()).unwrap();
        std::fs::write(folder.path().join("large"), &*blob("m", b"XY", 0.1, 10_000)).unwrap();
        Self(folder)
    }
    pub fn at(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }
    /// What `flash` says of one of them.
    #[track_caller]
    pub fn flash(&self, code: i32, name: &str, port: &str, options: &str) -> String {
        says(
            code,
            &format!("flash {} --port {port} {options}", self.at(name)),
        )
    }
    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap()
    }
}

#[test]
fn a_file_is_flashed_and_used_over_tcp_and_over_a_pseudo_terminal() {
    let files = Files::new();
    for serve in [Served::tcp, Served::pty] {
        let served = serve(desktop(WhileBusy::DualBank));
        let port = served.port.clone();
        let text = files.flash(0, "first", &port, "--activate");
        has(&text, "trueaxis-firmware");
        has(&text, "written to slot A and verified, number 1 in use");
        let text = files.flash(0, "second", &port, "");
        has(
            &text,
            "slot B and verified, number 2 not in use: `trueaxis control` activates",
        );
        let text = files.flash(0, "second", &port, "--json");
        let answer: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(answer["already"], true);
        assert_eq!(answer["active"], false);
        assert_eq!(answer["at_start"], false);
        let device = served.take();
        assert_eq!(
            device.device.activation(),
            Activation::Active(Some(Slot::A))
        );
        let slots = device.device.slots();
        assert_eq!(slots.blob(Slot::A), Some(&files.read("first")[..]));
        assert_eq!(slots.blob(Slot::B), Some(&files.read("second")[..]));
        let device = device.restart();
        assert_eq!(
            device.device.activation(),
            Activation::Active(Some(Slot::A)),
            "never activated, so no start takes it"
        );
        let served = serve(device);
        let text = files.flash(0, "second", &served.port, "--activate");
        has(&text, "slot B holds it already, as number 2 in use");
        assert_eq!(
            served.take().restart().device.activation(),
            Activation::Active(Some(Slot::B))
        );
    }
}

#[test]
fn another_machine_is_refused_unless_forced() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let port = served.port.clone();
    let flash = |code, name: &str, more: &str| {
        files.flash(code, name, &port, &format!("--activate {more}"))
    };
    // The first compensation is accepted by any machine.
    flash(0, "first", "");
    let text = flash(2, "other-name", "");
    has(
        &text,
        "is for `n` (XY), the controller has one for `m` (XY)",
    );
    has(&text, "--force if it is meant so");
    let text = flash(2, "other-axes", "");
    has(&text, "`m` (XZ)");
    let text = flash(0, "other-axes", "--force");
    has(&text, "slot B and verified, number 2 in use");
    let device = served.take();
    assert_eq!(device.device.compensation().axes()[1].name, b'Z');
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_erased() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let text = files.flash(2, "large", &served.port, "");
    has(&text, "bytes, the controller has room for 24192");
    let mut flash = served.take().stop();
    assert!(flash.image().iter().all(|byte| *byte == 0xFF));
}

#[test]
fn a_dry_run_uploads_nothing_and_prints_the_target_that_compile_reads() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let words = format!("flash --dry-run --port {}", served.port);
    let output = trueaxis(&words);
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let target = Target::from_toml(&text).unwrap();
    let expected = Target {
        name: "desktop".into(),
        bytes: Some(24_192),
        ..Target::stm32f405()
    };
    assert_eq!(target, expected, "{text}");
    let json = says(0, &format!("{words} --json"));
    let answer: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(answer["target"], serde_json::to_value(&expected).unwrap());
    // When saved, it can be passed to `compile`; then the slot is the limit.
    let example = |name| {
        format!(
            "{}/../../examples/kolibri/{name}",
            env!("CARGO_MANIFEST_DIR")
        )
    };
    let (machine, errors) = (example("machine.toml"), example("errors-12.toml"));
    std::fs::write(files.at("board.toml"), text.replace("24192", "2000")).unwrap();
    let (board, out) = (files.at("board.toml"), files.at("k.trax"));
    let compile = format!(
        "compile {machine} {errors} -o {out} --target {board} --random 200 --tolerance 0.05"
    );
    let text = says(1, &compile);
    has(&text, "the target desktop is too small for 0.05");
    has(&text, " of 2000 bytes");
    assert!(!std::fs::exists(&out).unwrap());
    std::fs::write(&board, target.to_toml()).unwrap();
    says(0, &compile);
    // A compensation is checked as for an upload.
    let text = files.flash(0, "first", &served.port, "--dry-run");
    has(&text, "first fits");
    let text = files.flash(2, "large", &served.port, "--dry-run");
    has(&text, "bytes, the controller has room for 24192");
    let mut flash = served.take().stop();
    assert!(flash.image().iter().all(|byte| *byte == 0xFF));
}

#[test]
fn a_machine_that_moves_is_not_flashed_where_the_flash_stalls_it() {
    let files = Files::new();
    let device = desktop(WhileBusy::Standstill);
    let standstill = device.standstill.clone();
    standstill.set(false);
    let served = Served::tcp(device);
    let flash = |code| files.flash(code, "first", &served.port, "--activate");
    let text = flash(2);
    has(&text, "only at standstill with drives off");
    has(&text, "stop the machine and switch its drives off");
    standstill.set(true);
    has(&flash(0), "in use");
    served.take();
}

#[test]
fn the_monitor_shows_positions_corrections_and_faults() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let port = served.port.clone();
    let text = says(0, &format!("monitor --port {port} --count 1"));
    has(&text, "fault no slot holds a valid compensation");
    has(&text, "slot A blank");
    files.flash(0, "first", &port, "--activate");
    {
        let address = port.strip_prefix("tcp:").unwrap();
        let (mut client, controller) = Client::connect(Tcp::open(address).unwrap()).unwrap();
        assert_eq!(
            (controller.machine.as_str(), controller.axes.as_str()),
            ("m", "XY")
        );
        client.set(&Request::Referenced(3)).unwrap();
        client.set(&Request::Enable(true)).unwrap();
        client.motion(&[[1.5, 20.0]; 500], 2).unwrap();
    }
    let text = says(0, &format!("monitor --port {port} --count 1"));
    has(&text, "slot A in use");
    has(&text, "enabled, factor 1.000");
    has(&text, "updates 500");
    has(&text, "frames 0, 0 periods without");
    has(&text, "overrun; fault pin: no fault");
    has(&text, "started power on");
    has(&text, "X 1.5000 0.0");
    let csv = format!("monitor --port {port} --csv --count 3 --interval 1");
    let output = String::from_utf8(trueaxis(&csv).stdout).unwrap();
    let lines: Vec<&str> = output.lines().collect();
    assert_eq!(lines.len(), 4, "{output}");
    assert!(lines[0].starts_with("time,X,Y,dX,dY,computed X,computed Y,factor,conditions"));
    for line in &lines[1..] {
        assert_eq!(line.split(',').count(), lines[0].split(',').count());
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields[1..3], ["1.5", "20"]);
        assert!(fields[3].parse::<f32>().unwrap() != 0.0);
    }
    let json = format!("monitor --port {port} --json --count 2 --interval 1");
    let output = String::from_utf8(trueaxis(&json).stdout).unwrap();
    for line in output.lines() {
        let object: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(object["enabled"], true);
        assert_eq!(object["positions"][1], 20.0);
        assert_eq!(object["health"]["healthy"], true);
        assert_eq!(object["health"]["restart"], "power on");
    }
    served.take();
}

#[test]
fn a_port_that_is_none_is_named() {
    let files = Files::new();
    let text = files.flash(2, "first", "tcp:nowhere", "");
    has(&text, "not a `tcp:host:port`");
    let text = files.flash(2, "first", "/dev/no-such-port", "");
    has(&text, "/dev/no-such-port: cannot be opened");
    let text = says(2, "monitor --port tcp:127.0.0.1:1");
    has(&text, "cannot be opened");
}

/// A device with a defect in the slot that the first upload uses.
fn defective(defect: Defect) -> Desktop {
    let mut flash = MockFlash::new(96).with_while_busy(WhileBusy::DualBank);
    flash.set_defect(Slot::A, 300, defect);
    Desktop::start(flash, 0.001)
}

#[test]
fn a_word_that_an_erase_mends_is_flashed_without_a_word_to_the_user() {
    let files = Files::new();
    let served = Served::tcp(defective(Defect::UntilErased));
    files.flash(0, "first", &served.port, "");
    served.take();
}

#[test]
fn a_block_that_stays_bad_is_named_to_the_user_and_not_worn_out() {
    let files = Files::new();
    for defect in [Defect::Refuses, Defect::Misreads] {
        let served = Served::tcp(defective(defect));
        for _ in 0..3 {
            let text = files.flash(2, "first", &served.port, "");
            has(&text, "Slot unusable: block 1");
        }
        let flash = served.take().stop();
        assert_eq!(flash.erases(Slot::A)[1], 2);
    }
}
