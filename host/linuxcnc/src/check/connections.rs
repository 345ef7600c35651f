//! Checks the connections of the component's pins.

use super::{CheckState, JointAxis};
use crate::formats::hal::HalCommand;
use crate::formats::ini::FileLocation;
use trueaxis::AuxiliaryKind;

impl CheckState<'_> {
    /// The pins of a joint.
    pub(super) fn connections(&mut self, JointAxis { number, .. }: JointAxis) {
        let hal = &self.configuration.hal;
        let loaded = self
            .component
            .map_or(&self.configuration.start, |c| &c.place)
            .clone();
        let pairs = [
            ("pos-in", "pos-cmd"),
            ("homed", "homed"),
            ("homing", "homing"),
            ("motor-cmd-in", "motor-pos-cmd"),
            ("motor-fb-out", "motor-pos-fb"),
        ];
        for (ours, theirs) in pairs {
            self.connection(number, ours, theirs, &loaded);
        }
        for (ours, way) in [
            ("motor-cmd-out", "to the drive of the joint"),
            ("motor-fb-in", "to what the drive reports"),
        ] {
            let pin = format!("trueaxis.joint.{number}.{ours}");
            let others = hal
                .signal(&pin)
                .map_or(0, |signal| hal.pins(signal).count());
            if others < 2 {
                let place = hal
                    .signals
                    .get(&pin)
                    .map_or(&loaded, |(_, command)| &command.place)
                    .clone();
                let write = match ours {
                    "motor-cmd-out" => format!("net joint-{number}-drive {pin} => (the drive)"),
                    _ => format!("net joint-{number}-feedback (the drive) => {pin}"),
                };
                self.refuse(&place, format!("{pin} is not connected {way}"), write);
            }
        }
        self.drives_of_joint(number);
    }

    /// A pin of the component that belongs on the signal of one of the motion controller's.
    fn connection(&mut self, number: usize, ours: &str, theirs: &str, loaded: &FileLocation) {
        let hal = &self.configuration.hal;
        let (pin, joint) = (
            format!("trueaxis.joint.{number}.{ours}"),
            format!("joint.{number}.{theirs}"),
        );
        let [from, to] = [hal.signal(&pin), hal.signal(&joint)];
        if from.is_some() && from == to {
            return;
        }
        let place = hal.signals.get(&pin).or_else(|| hal.signals.get(&joint));
        let place = place.map_or(loaded, |(_, command)| &command.place).clone();
        let motor = format!("joint.{number}.motor-pos-cmd");
        let wrong = from.and_then(|signal| hal.pins(signal).find(|p| **p == *motor));
        let reason = match (wrong, from) {
            (Some(_), _) if ours == "pos-in" => format!(
                "{pin} comes from {motor}, which contains backlash and homing offset: tables would be read at the wrong place"
            ),
            (_, Some(signal)) => format!("{pin} is on the signal {signal}, not with {joint}"),
            (_, None) => format!("{pin} is not connected to {joint}"),
        };
        let unlink = match (from, to) {
            (Some(_), _) => format!("unlinkp {pin}, then "),
            (None, Some(_)) if ours.starts_with("motor") => format!("unlinkp {joint}, then "),
            _ => String::new(),
        };
        let write = match (to, ours) {
            (Some(signal), _) if !ours.starts_with("motor") => {
                format!("{unlink}net {signal} => {pin}")
            }
            (_, "motor-fb-out") => format!("{unlink}net trueaxis-{number}-fb {pin} => {joint}"),
            _ => format!(
                "{unlink}net trueaxis-{number}-{} {joint} => {pin}",
                theirs.trim_start_matches("motor-")
            ),
        };
        self.refuse(&place, reason, write);
    }

    /// What gets the command of the motion controller without the correction.
    fn drives_of_joint(&mut self, number: usize) {
        let hal = &self.configuration.hal;
        let motor = format!("joint.{number}.motor-pos-cmd");
        let Some((signal, command)) = hal.signals.get(&motor) else {
            return;
        };
        let ours = |pin: &&str| pin.starts_with("trueaxis") || **pin == *motor;
        let others: Vec<&str> = hal.pins(signal).filter(|pin| !ours(pin)).collect();
        if !others.is_empty() {
            let write = format!(
                "net joint-{number}-drive trueaxis.joint.{number}.motor-cmd-out => {}",
                others.join(" ")
            );
            self.warn(
                &command.place.clone(),
                format!(
                    "{} gets the command of joint {number} without its correction",
                    others.join(", ")
                ),
                write,
            );
        }
    }

    /// Tool length, temperatures, enabling.
    pub(super) fn inputs(&mut self) {
        let hal = &self.configuration.hal;
        let Some(loaded) = self.component else { return };
        let is_there = |pin: &str| hal.signals.contains_key(pin) || hal.values.contains_key(pin);
        let compensation = self.against.runtime.compensation();
        let used = compensation.inputs_used();
        // One pin for each sensor, whatever its lags.
        let mut sensors: Vec<&str> = Vec::new();
        for (a, auxiliary) in compensation.auxiliaries().iter().enumerate() {
            let is_used = used >> (compensation.axes().len() + a) & 1 == 1;
            let (pin, write) = match auxiliary.kind {
                AuxiliaryKind::ToolLength => {
                    let pin = "trueaxis.tool-length".to_owned();
                    (
                        pin,
                        "net tool-length motion.tooloffset.z => trueaxis.tool-length".to_owned(),
                    )
                }
                AuxiliaryKind::Temperature => {
                    let name = auxiliary.name.as_str();
                    let earlier = sensors.iter().position(|s| *s == name);
                    let number = earlier.unwrap_or(sensors.len());
                    if earlier.is_none() {
                        sensors.push(name);
                    }
                    let pin = format!("trueaxis.temperature-{number}");
                    let write = format!("net {} (the sensor, °C) => {pin}", auxiliary.name);
                    (pin, write)
                }
            };
            if is_used && !is_there(&pin) {
                let reason = format!(
                    "a correction depends on `{}`, and {pin} is not connected",
                    auxiliary.name
                );
                self.refuse(&loaded.place.clone(), reason, write);
            }
        }
        let temperatures = sensors.len();
        let given = loaded
            .parameter("temperatures")
            .map_or(Some(0), |t| t.parse().ok());
        if given.is_none_or(|given| given < temperatures) {
            self.refuse(
                &loaded.place.clone(),
                format!(
                    "the compensation has {temperatures} temperatures, the component fewer pins"
                ),
                format!("temperatures={temperatures}"),
            );
        }
        self.weights(loaded);
        if !is_there("trueaxis.enable") {
            self.warn(
                &loaded.place.clone(),
                "nothing ever enables the corrections".to_owned(),
                "net SIGNAL => trueaxis.enable from a switch, or setp trueaxis.enable 0 and `trueaxis control --hal enable`"
                    .to_owned(),
            );
        }
    }

    /// Pins for the weights of adjustable terms.
    fn weights(&mut self, loaded: &HalCommand) {
        let terms = self.against.runtime.compensation().weights().iter().count();
        let given = loaded
            .parameter("weights")
            .map_or(Some(0), |w| w.parse::<usize>().ok());
        let reason = match given {
            Some(given) if given == terms => return,
            Some(0) => format!(
                "the compensation has {terms} adjustable terms, and weights= is not given: they keep the weights of the file"
            ),
            Some(given) if given < terms => format!(
                "the compensation has {terms} adjustable terms, the component {given} pins: the remaining terms keep the weights of the file"
            ),
            Some(given) => format!(
                "weights={given} makes pins without effect: the compensation has {terms} adjustable terms"
            ),
            None => "weights= is not a number".to_owned(),
        };
        let place = loaded.place.clone();
        let write = format!("weights={terms}");
        match given {
            Some(_) => self.warn(&place, reason, write),
            None => self.refuse(&place, reason, write),
        }
    }
}
