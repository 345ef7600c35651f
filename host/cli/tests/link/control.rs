//! `trueaxis control`, as a user runs it.

use crate::command::{Files, desktop, has, says};
use crate::served::Served;
use serde_json::Value;
use trueaxis::link::{Activation, Request, Slot};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_link::{Client, Tcp};

/// A device with both examples: A was used before, B is in use.
fn both(files: &Files, while_busy: WhileBusy) -> Served {
    let served = Served::tcp(desktop(while_busy));
    for name in ["first", "second"] {
        files.flash(0, name, &served.port, "--activate");
    }
    served
}

#[track_caller]
fn control(code: i32, served: &Served, words: &str) -> String {
    says(code, &format!("control --port {} {words}", served.port))
}

fn json(served: &Served, words: &str) -> Value {
    serde_json::from_str(&control(0, served, &format!("--json {words}"))).unwrap()
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
    let text = control(0, &served, "show");
    has(&text, "corrections disabled, out");
    has(&text, "compensation slot B in use");
    has(&text, "at start slot B, disabled; for a rollback slot A");
    has(&text, "referenced none");
    let text = control(0, &served, "reference xy");
    has(&text, "referenced none -> XY");
    let text = control(0, &served, "enable");
    has(&text, "corrections disabled, out -> enabled, out");
    moved(&served);
    let text = control(0, &served, "show");
    has(&text, "corrections enabled, in compensation");
    let text = control(0, &served, "dry-run on");
    has(&text, "-> enabled, dry run");
    let done = json(&served, "dry-run off");
    assert_eq!(done["before"]["dry_run"], true);
    assert_eq!(done["after"]["dry_run"], false);
    let done = json(&served, "disable");
    assert_eq!(done["before"]["enabled"], true);
    assert_eq!(done["after"]["enabled"], false);
    moved(&served);
    assert_eq!(json(&served, "show")["after"]["factor"], 0.0);
    let done = json(&served, "reference Y");
    assert_eq!(done["before"]["referenced"], "XY");
    assert_eq!(done["after"]["referenced"], "Y");
    assert_eq!(json(&served, "reference all")["after"]["referenced"], "XY");
    assert_eq!(json(&served, "reference none")["after"]["referenced"], "");
    served.take();
}

#[test]
fn what_is_in_use_and_whether_it_is_let_in_outlasts_a_restart() {
    let files = Files::new();
    for while_busy in [WhileBusy::DualBank, WhileBusy::Standstill] {
        let mut served = both(&files, while_busy);
        let text = control(0, &served, "rollback");
        has(&text, "compensation slot B in use -> slot A in use");
        has(&text, "-> slot A, disabled; for a rollback slot B");
        let text = control(0, &served, "enable-at-start on");
        has(&text, "-> slot A, enabled; for a rollback slot B");
        let device = served.take().restart();
        assert_eq!(active(&device), Some(Slot::A));
        served = Served::tcp(device);
        let done = json(&served, "show");
        assert_eq!(done["after"]["enabled"], true);
        assert_eq!(done["after"]["at_start"]["storing"], "stored");
        let done = json(&served, "activate b");
        assert_eq!(
            (&done["before"]["active"], &done["after"]["active"]),
            (&"A".into(), &"B".into())
        );
        let done = json(&served, "enable-at-start off");
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
    let text = control(2, &served, "enable-at-start on");
    has(&text, "only at standstill with drives off");
    has(&text, "stop the machine and switch its drives off");
    let text = control(0, &served, "rollback");
    has(&text, "compensation slot B in use -> slot A in use");
    let pending = "the change is stored at the next standstill with drives off";
    has(&text, pending);
    // Flashing a compensation that is already there reports it, too.
    let text = files.flash(0, "second", &served.port, "--activate");
    has(&text, "slot B holds it already");
    control(0, &served, "rollback");
    standstill.set(true);
    let done = json(&served, "show");
    assert_eq!(done["after"]["active"], "A");
    let device = served.take().restart();
    assert_eq!(active(&device), Some(Slot::A));
}

#[test]
fn a_weight_is_shown_with_its_axis_and_limits_and_what_is_wrong_is_named() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let text = control(2, &served, "weight 1 0.5");
    has(
        &text,
        "does not exist or has a fixed weight; adjustable: none",
    );
    files.flash(0, "adjustable", &served.port, "--activate");
    let text = control(0, &served, "weight 1 -0.25");
    has(
        &text,
        "weight 1 0.5 on Y, from -1 to 1 -> -0.25 on Y, from -1 to 1",
    );
    let text = control(2, &served, "weight 1 1.5");
    has(&text, "the weight must be a number from -1 to 1");
    has(&text, "give a weight within the limits");
    let text = control(2, &served, "weight 0 1");
    has(
        &text,
        "term 0 does not exist or has a fixed weight; adjustable: 1",
    );
    for value in ["nan", "inf"] {
        let text = control(2, &served, &format!("weight 1 {value}"));
        has(&text, "is not a finite number");
        let text = control(2, &served, &format!("tool-length {value}"));
        has(&text, "is not a finite number");
    }
    assert_eq!(json(&served, "show")["after"]["weights"][0]["value"], -0.25);
    let text = control(2, &served, "reference XQ");
    has(&text, "there is no axis Q; the axes are XY");
    let text = control(0, &served, "tool-length 120.5");
    has(&text, "auxiliary 0 NaN -> 120.500");
    served.take();
}

#[test]
fn what_the_controller_refuses_is_said_in_words() {
    let files = Files::new();
    let served = Served::tcp(desktop(WhileBusy::DualBank));
    let text = control(2, &served, "enable-at-start on");
    has(&text, "there is no active compensation");
    has(&text, "flash one with --activate first");
    let text = control(2, &served, "activate B");
    has(&text, "the slot holds no valid compensation");
    let text = control(2, &served, "rollback");
    has(&text, "there is no compensation to go back to");
    let flash = |name: &str, more: &str| files.flash(0, name, &served.port, more);
    flash("first", "");
    let text = control(0, &served, "show");
    has(
        &text,
        "at start no slot, disabled; slot A waits to be activated",
    );
    flash("first", "--activate");
    // There is no way back to a slot that was never in use.
    flash("other-name", "--force");
    let text = control(2, &served, "rollback");
    has(&text, "`activate` for one that waits");
    let text = control(2, &served, "activate B");
    has(&text, "for another machine");
    has(&text, "--force if it is meant so");
    let text = control(0, &served, "activate B --force");
    has(&text, "slot A in use -> slot B in use");
    served.take();
}

#[test]
fn settings_reach_a_controller_that_other_requests_reach_too() {
    // Two programs take turns on one line; each says hello again.
    let files = Files::new();
    let served = both(&files, WhileBusy::DualBank);
    control(0, &served, "enable");
    let address = served.port.strip_prefix("tcp:").unwrap();
    let (mut client, _) = Client::connect(Tcp::open(address).unwrap()).unwrap();
    assert!(client.status().unwrap().enabled);
    client.set(&Request::Enable(false)).unwrap();
    drop(client);
    assert_eq!(json(&served, "show")["after"]["enabled"], false);
    served.take();
}
