//! `trueaxis control`, as a user runs it.

use crate::command::{Files, desktop, says, trueaxis};
use crate::served::Served;
use serde_json::Value;
use trueaxis::link::{Activation, Request, Slot};
use trueaxis_controllers::link::{Client, Tcp};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::slots::WhileBusy;

/// A device with both examples: A was used before, B is in use.
fn both(files: &Files, while_busy: WhileBusy) -> Served {
    let served = Served::tcp(desktop(while_busy));
    for name in ["first", "second"] {
        let arguments = [
            "flash",
            &files.at(name),
            "--port",
            &served.port,
            "--activate",
        ];
        says(0, &arguments);
    }
    served
}

fn control(code: i32, served: &Served, words: &[&str]) -> String {
    says(
        code,
        &[&["control", "--port", &served.port], words].concat(),
    )
}

fn json(served: &Served, words: &[&str]) -> Value {
    let arguments = [&["control", "--port", &served.port, "--json"], words].concat();
    let output = trueaxis(&arguments);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Updates the servo, like a motion controller at standstill.
fn moved(served: &Served) {
    let address = served.port.strip_prefix("tcp:").unwrap();
    let (mut client, _) = Client::connect(Tcp::open(address).unwrap()).unwrap();
    client.motion(&[[1.5, 20.0]; 1500], 2).unwrap();
}

fn active(device: &Desktop) -> Option<Slot> {
    match device.device.activation() {
        Activation::Active(slot) => slot,
        other => panic!("{other:?}"),
    }
}

#[test]
fn corrections_come_in_and_go_out_and_each_step_is_shown() {
    let files = Files::new();
    let served = both(&files, WhileBusy::DualBank);
    let text = control(0, &served, &["show"]);
    assert!(text.contains("corrections disabled, out"), "{text}");
    assert!(text.contains("compensation slot B in use"), "{text}");
    assert!(
        text.contains("at start slot B, disabled; for a rollback slot A"),
        "{text}"
    );
    assert!(text.contains("referenced none"), "{text}");
    let text = control(0, &served, &["reference", "xy"]);
    assert!(text.contains("referenced none -> XY"), "{text}");
    let text = control(0, &served, &["enable"]);
    assert!(
        text.contains("corrections disabled, out -> enabled, out"),
        "{text}"
    );
    moved(&served);
    let text = control(0, &served, &["show"]);
    assert!(
        text.contains("corrections enabled, in compensation"),
        "{text}"
    );
    let text = control(0, &served, &["dry-run", "on"]);
    assert!(text.contains("-> enabled, dry run"), "{text}");
    let done = json(&served, &["dry-run", "off"]);
    assert_eq!(done["before"]["dry_run"], true);
    assert_eq!(done["after"]["dry_run"], false);
    let done = json(&served, &["disable"]);
    assert_eq!(done["before"]["enabled"], true);
    assert_eq!(done["after"]["enabled"], false);
    moved(&served);
    assert_eq!(json(&served, &["show"])["after"]["factor"], 0.0);
    let done = json(&served, &["reference", "Y"]);
    assert_eq!(done["before"]["referenced"], "XY");
    assert_eq!(done["after"]["referenced"], "Y");
    assert_eq!(
        json(&served, &["reference", "all"])["after"]["referenced"],
        "XY"
    );
    assert_eq!(
        json(&served, &["reference", "none"])["after"]["referenced"],
        ""
    );
    served.take();
}

#[test]
fn what_is_in_use_and_whether_it_is_let_in_outlasts_a_restart() {
    let files = Files::new();
    for while_busy in [WhileBusy::DualBank, WhileBusy::Standstill] {
        let mut served = both(&files, while_busy);
        let text = control(0, &served, &["rollback"]);
        assert!(
            text.contains("compensation slot B in use -> slot A in use"),
            "{text}"
        );
        assert!(
            text.contains("-> slot A, disabled; for a rollback slot B"),
            "{text}"
        );
        let text = control(0, &served, &["enable-at-start", "on"]);
        assert!(
            text.contains("-> slot A, enabled; for a rollback slot B"),
            "{text}"
        );
        let device = served.take().restart();
        assert_eq!(active(&device), Some(Slot::A));
        served = Served::tcp(device);
        let done = json(&served, &["show"]);
        assert_eq!(done["after"]["enabled"], true);
        assert_eq!(done["after"]["at_start"]["storing"], "stored");
        let done = json(&served, &["activate", "b"]);
        assert_eq!(
            (&done["before"]["active"], &done["after"]["active"]),
            (&"A".into(), &"B".into())
        );
        let done = json(&served, &["enable-at-start", "off"]);
        assert_eq!(done["before"]["at_start"]["enable"], true);
        assert_eq!(done["after"]["at_start"]["enable"], false);
        let mut device = served.take().restart();
        assert_eq!(active(&device), Some(Slot::B));
        assert!(!device.device.report().enabled);
    }
}

#[test]
fn what_can_only_be_stored_at_standstill_is_refused_or_pending_and_said() {
    let files = Files::new();
    let served = both(&files, WhileBusy::Standstill);
    let device = served.take();
    let standstill = device.standstill.clone();
    standstill.set(false);
    let served = Served::tcp(device);
    let text = control(2, &served, &["enable-at-start", "on"]);
    assert!(
        text.contains("only at standstill with drives off"),
        "{text}"
    );
    assert!(
        text.contains("stop the machine and switch its drives off"),
        "{text}"
    );
    let text = control(0, &served, &["rollback"]);
    assert!(
        text.contains("compensation slot B in use -> slot A in use"),
        "{text}"
    );
    let pending = "the change is stored at the next standstill with drives off";
    assert!(text.contains(pending), "{text}");
    // Flashing a compensation that is already there reports it, too.
    let text = says(
        0,
        &[
            "flash",
            &files.at("second"),
            "--port",
            &served.port,
            "--activate",
        ],
    );
    assert!(text.contains("slot B holds it already"), "{text}");
    control(0, &served, &["rollback"]);
    standstill.set(true);
    let done = json(&served, &["show"]);
    assert_eq!(done["after"]["active"], "A");
    let device = served.take().restart();
    assert_eq!(active(&device), Some(Slot::A));
}

#[test]
fn a_weight_is_shown_with_its_axis_and_limits_and_what_is_wrong_is_named() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let text = control(2, &served, &["weight", "1", "0.5"]);
    assert!(
        text.contains("does not exist or has a fixed weight; adjustable: none"),
        "{text}"
    );
    says(
        0,
        &[
            "flash",
            &files.at("adjustable"),
            "--port",
            &served.port,
            "--activate",
        ],
    );
    let text = control(0, &served, &["weight", "1", "-0.25"]);
    assert!(
        text.contains("weight 1 0.5 on Y, from -1 to 1 -> -0.25 on Y, from -1 to 1"),
        "{text}"
    );
    let text = control(2, &served, &["weight", "1", "1.5"]);
    assert!(
        text.contains("the weight must be a number from -1 to 1"),
        "{text}"
    );
    assert!(text.contains("give a weight within the limits"), "{text}");
    let text = control(2, &served, &["weight", "0", "1"]);
    assert!(
        text.contains("term 0 does not exist or has a fixed weight; adjustable: 1"),
        "{text}"
    );
    for value in ["nan", "inf"] {
        let text = control(2, &served, &["weight", "1", value]);
        assert!(text.contains("is not a finite number"), "{text}");
        let text = control(2, &served, &["tool-length", value]);
        assert!(text.contains("is not a finite number"), "{text}");
    }
    assert_eq!(
        json(&served, &["show"])["after"]["weights"][0]["value"],
        -0.25
    );
    let text = control(2, &served, &["reference", "XQ"]);
    assert!(
        text.contains("there is no axis Q; the axes are XY"),
        "{text}"
    );
    let text = control(0, &served, &["tool-length", "120.5"]);
    assert!(text.contains("auxiliary 0 NaN -> 120.500"), "{text}");
    served.take();
}

#[test]
fn what_the_controller_refuses_is_said_in_words() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let text = control(2, &served, &["enable-at-start", "on"]);
    assert!(text.contains("there is no active compensation"), "{text}");
    assert!(text.contains("flash one with --activate first"), "{text}");
    let text = control(2, &served, &["activate", "B"]);
    assert!(
        text.contains("the slot holds no valid compensation"),
        "{text}"
    );
    let text = control(2, &served, &["rollback"]);
    assert!(
        text.contains("there is no compensation to go back to"),
        "{text}"
    );
    let flash = |name: &str, more: &[&str]| {
        let file = files.at(name);
        says(
            0,
            &[&["flash", &file, "--port", &served.port], more].concat(),
        )
    };
    flash("first", &[]);
    let text = control(0, &served, &["show"]);
    assert!(
        text.contains("at start no slot, disabled; slot A waits to be activated"),
        "{text}"
    );
    flash("first", &["--activate"]);
    // There is no way back to a slot that was never in use.
    flash("other-name", &["--force"]);
    let text = control(2, &served, &["rollback"]);
    assert!(text.contains("`activate` for one that waits"), "{text}");
    let text = control(2, &served, &["activate", "B"]);
    assert!(text.contains("for another machine"), "{text}");
    assert!(text.contains("--force if it is meant so"), "{text}");
    let text = control(0, &served, &["activate", "B", "--force"]);
    assert!(text.contains("slot A in use -> slot B in use"), "{text}");
    served.take();
}

#[test]
fn settings_reach_a_controller_that_other_requests_reach_too() {
    // Two programs take turns on one line; each says hello again.
    let files = Files::new();
    let served = both(&files, WhileBusy::DualBank);
    control(0, &served, &["enable"]);
    let address = served.port.strip_prefix("tcp:").unwrap();
    let (mut client, _) = Client::connect(Tcp::open(address).unwrap()).unwrap();
    assert!(client.status().unwrap().enabled);
    client.set(&Request::Enable(false)).unwrap();
    drop(client);
    assert_eq!(json(&served, &["show"])["after"]["enabled"], false);
    served.take();
}
