//! Probes a plan, move by move, on a machine that answers.
//!
//! A program in a controller cannot be relied on: LinuxCNC reads lines ahead, and a probing move in a program may end it
//! early without a message when the computer is busy. Here every touch is confirmed and logged before the next move.

use crate::plan::{AxisTargets, ProbingStep};
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_model::machine::{Machine, PerAxis};

/// A machine with a probe.
pub trait Prober {
    /// The reason for a failed command.
    type Error;

    /// A rapid move with the stylus clear of everything.
    ///
    /// # Errors
    /// The probe was tripped, or the move did not reach its end.
    fn rapid(&mut self, to: &AxisTargets) -> Result<(), Self::Error>;

    /// A move with the stylus near a ball, at a feed rate in mm/min.
    ///
    /// # Errors
    /// As for [`rapid`](Self::rapid).
    fn near(&mut self, to: &AxisTargets, feed: f64) -> Result<(), Self::Error>;

    /// A move away from a contact; the probe may be tripped until it ends.
    ///
    /// # Errors
    /// The move did not reach its end.
    fn retreat(&mut self, to: &AxisTargets, feed: f64) -> Result<(), Self::Error>;

    /// A move until there is contact; `None` if there was none.
    ///
    /// # Errors
    /// The probe was tripped before it, or it was interrupted.
    fn touch(&mut self, end: &AxisTargets, feed: f64) -> Result<Option<Contact>, Self::Error>;

    /// Turns the spindle to an angle (deg).
    ///
    /// # Errors
    /// It cannot.
    fn orient(&mut self, angle: f64) -> Result<(), Self::Error>;
}

/// A contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Time (s).
    pub time: f64,
    /// Temperature of the machine (°C).
    pub temperature: Option<f64>,
}

/// How a machine moves while it probes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speeds {
    /// Near the balls (mm/min).
    pub near: f64,
    /// The first touch, which looks for the surface (mm/min).
    pub first: f64,
    /// The second one, which counts (mm/min).
    pub second: f64,
    /// Distance between them (mm).
    pub retreat: f64,
}

/// A touch that counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchRecord<'a> {
    /// Row of the plan.
    pub row: &'a Probing,
    /// Number of the touch in its row, from 1.
    pub touch: usize,
    /// The contact.
    pub contact: Contact,
}

/// Why a plan was not probed to its end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError<E> {
    /// The machine.
    #[error("{0}")]
    Machine(E),
    /// Nothing was touched.
    #[error("no contact: touch {touch} of ball {ball} (line {line} of the plan)")]
    NoContact {
        /// Line of the plan.
        line: usize,
        /// Name of the ball.
        ball: String,
        /// Number of the touch, from 1.
        touch: usize,
    },
    /// The log cannot be written.
    #[error("the log cannot be written: {0}")]
    Log(String),
}

/// Probes all `steps` of a plan and hands over each touch before the next move.
///
/// # Errors
/// [`ProbeError`], at the first problem.
pub fn probe<P: Prober>(
    plan: &Probings,
    steps: &[ProbingStep],
    speeds: Speeds,
    prober: &mut P,
    record: &mut dyn FnMut(&TouchRecord<'_>) -> std::io::Result<()>,
) -> Result<(), ProbeError<P::Error>> {
    let machine = ProbeError::Machine;
    let mut current = 0;
    for step in steps {
        match step {
            ProbingStep::Row(row) => current = *row,
            ProbingStep::Orient(angle) => prober.orient(*angle).map_err(machine)?,
            ProbingStep::Rapid(to) => prober.rapid(to).map_err(machine)?,
            ProbingStep::Near(to) => prober.near(to, speeds.near).map_err(machine)?,
            ProbingStep::Touch { number, begin, end } => {
                let row = &plan.rows[current];
                let no_contact = || ProbeError::NoContact {
                    line: row.line,
                    ball: plan.balls[row.ball].clone(),
                    touch: number + 1,
                };
                let first = prober.touch(end, speeds.first).map_err(machine)?;
                let first = first.ok_or_else(no_contact)?;
                let back = between(&first.position, begin, speeds.retreat);
                prober.retreat(&back, speeds.near).map_err(machine)?;
                let second = prober.touch(end, speeds.second).map_err(machine)?;
                let contact = second.ok_or_else(no_contact)?;
                prober.retreat(begin, speeds.near).map_err(machine)?;
                record(&TouchRecord {
                    row,
                    touch: number + 1,
                    contact,
                })
                .map_err(|error| ProbeError::Log(error.to_string()))?;
            }
        }
    }
    Ok(())
}

/// A position at a distance (mm) from the contact on the way back to where the touch began; at most there.
fn between(contact: &PerAxis, begin: &AxisTargets, distance: f64) -> AxisTargets {
    let ways = begin.iter().map(|(i, begin)| begin - contact[*i]);
    let length = ways.map(|way| way * way).sum::<f64>().sqrt();
    let part = if length > distance {
        distance / length
    } else {
        1.0
    };
    (begin.iter())
        .map(|(i, begin)| (*i, contact[*i] + part * (begin - contact[*i])))
        .collect()
}

/// About how long the steps take (s), where rapid moves take this long each.
#[must_use]
pub fn duration(steps: &[ProbingStep], speeds: Speeds, rapid: f64) -> f64 {
    let mut last: AxisTargets = Vec::new();
    let mut seconds = 0.0;
    for step in steps {
        seconds += match step {
            ProbingStep::Row(_) => 0.0,
            ProbingStep::Orient(_) | ProbingStep::Rapid(_) => rapid,
            ProbingStep::Near(to) => {
                let way = distance(&last, to);
                last.clone_from(to);
                60.0 * way / speeds.near
            }
            ProbingStep::Touch { begin, end, .. } => {
                let way = distance(begin, end);
                60.0 * (way / speeds.first + 2.0 * speeds.retreat / speeds.second)
            }
        };
    }
    seconds
}

/// Distance between two positions of the same axes; 0 if they are of different ones.
fn distance(from: &AxisTargets, to: &AxisTargets) -> f64 {
    if from.len() != to.len() {
        return 0.0;
    }
    let ways = from.iter().zip(to).map(|((_, a), (_, b))| a - b);
    ways.map(|way| way * way).sum::<f64>().sqrt()
}

/// Header of the log, with its line end.
#[must_use]
pub fn header(machine: &Machine, has_temperature: bool) -> String {
    let mut text = "row,ball,touch".to_owned();
    for axis in &machine.axes {
        text += &format!(",{}", axis.letter);
    }
    text += ",time_s";
    if has_temperature {
        text += ",temperature_C";
    }
    text + "\n"
}

impl TouchRecord<'_> {
    /// A line of the log: a touch with its labels (mm, deg, s, °C).
    #[must_use]
    pub fn line(&self, machine: &Machine, plan: &Probings) -> String {
        let Self {
            row,
            touch,
            contact,
        } = self;
        let ball = &plan.balls[row.ball];
        let mut text = format!("{},{ball},{touch}", row.line);
        for position in &contact.position[..machine.axes.len()] {
            text += &format!(",{position:.6}");
        }
        text += &format!(",{:.2}", contact.time);
        if let Some(celsius) = contact.temperature {
            text += &format!(",{celsius:.3}");
        }
        text + "\n"
    }
}

/// What a log that was stopped early has of a plan: its lines for rows with all `per_ball` touches, with the header,
/// and the rows that are missing. `None` if it is not a log of these rows.
#[must_use]
pub fn resume(
    log: &str,
    header: &str,
    plan: &Probings,
    per_ball: usize,
) -> Option<(String, Probings)> {
    let lines = log.strip_prefix(header)?;
    let mut lines = lines.split_inclusive('\n').peekable();
    let mut kept = header.to_owned();
    let mut rows = plan.rows.iter().peekable();
    while let Some(row) = rows.peek() {
        let own = format!("{},{},", row.line, plan.balls[row.ball]);
        let mut touches = String::new();
        let mut count = 0;
        while count < per_ball
            && let Some(line) = lines.next_if(|line| line.starts_with(&own) && line.ends_with('\n'))
        {
            touches += line;
            count += 1;
        }
        if count < per_ball {
            break;
        }
        kept += &touches;
        rows.next();
    }
    // Whatever follows may only be the touches of the row that was interrupted.
    let own = rows
        .peek()
        .map(|row| format!("{},{},", row.line, plan.balls[row.ball]));
    let is_cut =
        |line: &str| !line.ends_with('\n') || own.as_ref().is_some_and(|own| line.starts_with(own));
    lines.all(is_cut).then(|| {
        let rest = Probings {
            rows: rows.cloned().collect(),
            ..plan.clone()
        };
        (kept, rest)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Probings {
        let row = |line| Probing {
            line,
            ..Probing::default()
        };
        Probings {
            balls: vec!["1".to_owned()],
            rows: vec![row(2), row(3)],
        }
    }

    #[test]
    fn a_log_is_resumed_after_its_last_whole_row() {
        let touches = |row: usize, count: usize| -> String {
            (1..=count).map(|k| format!("{row},1,{k},0\n")).collect()
        };
        let (head, plan) = ("row,ball,touch,X\n", plan());
        let log = format!("{head}{}{}3,1,4,0.", touches(2, 5), touches(3, 3));
        let (kept, rest) = resume(&log, head, &plan, 5).unwrap();
        assert_eq!(kept, format!("{head}{}", touches(2, 5)));
        assert_eq!(rest.rows, plan.rows[1..]);
        let (kept, rest) = resume(&log[..head.len()], head, &plan, 5).unwrap();
        assert_eq!((kept.as_str(), rest.rows.len()), (head, 2));
        let whole = format!("{head}{}{}", touches(2, 5), touches(3, 5));
        assert!(resume(&whole, head, &plan, 5).unwrap().1.rows.is_empty());
        // Logs of others: another header, a row that is not there, and more than all rows.
        assert!(resume(&whole, "row,ball,touch,Y\n", &plan, 5).is_none());
        assert!(resume(&format!("{head}{}", touches(7, 5)), head, &plan, 5).is_none());
        assert!(resume(&format!("{whole}{}", touches(3, 1)), head, &plan, 5).is_none());
    }

    /// Records its commands, and fails or finds no contact at a given one.
    #[derive(Default)]
    struct Recorder {
        moves: Vec<String>,
        fails_at: Option<usize>,
        finds_nothing_at: Option<usize>,
    }

    impl Recorder {
        fn record(&mut self, what: &str) -> Result<(), &'static str> {
            self.moves.push(what.to_owned());
            match self.fails_at == Some(self.moves.len()) {
                true => Err("stopped"),
                false => Ok(()),
            }
        }
    }

    impl Prober for Recorder {
        type Error = &'static str;

        fn rapid(&mut self, _: &AxisTargets) -> Result<(), Self::Error> {
            self.record("rapid")
        }

        fn near(&mut self, _: &AxisTargets, _: f64) -> Result<(), Self::Error> {
            self.record("near")
        }

        fn retreat(&mut self, _: &AxisTargets, _: f64) -> Result<(), Self::Error> {
            self.record("retreat")
        }

        fn touch(&mut self, end: &AxisTargets, feed: f64) -> Result<Option<Contact>, Self::Error> {
            self.record(&format!("touch {feed}"))?;
            let mut position = PerAxis::default();
            for (axis, at) in end {
                position[*axis] = *at;
            }
            let contact = Contact {
                position,
                time: 0.0,
                temperature: None,
            };
            Ok((self.finds_nothing_at != Some(self.moves.len())).then_some(contact))
        }

        fn orient(&mut self, _: f64) -> Result<(), Self::Error> {
            self.record("orient")
        }
    }

    fn steps() -> Vec<ProbingStep> {
        let touch = |number| ProbingStep::Touch {
            number,
            begin: vec![(0, 0.0)],
            end: vec![(0, 5.0)],
        };
        vec![
            ProbingStep::Row(0),
            ProbingStep::Rapid(vec![(0, 0.0)]),
            touch(0),
            ProbingStep::Row(1),
            ProbingStep::Near(vec![(0, 0.0)]),
            touch(1),
        ]
    }

    const SPEEDS: Speeds = Speeds {
        near: 1000.0,
        first: 200.0,
        second: 30.0,
        retreat: 0.3,
    };

    /// Probes with a machine; returns lines and numbers of the logged touches, and how it ended.
    fn probed(recorder: &mut Recorder) -> (Vec<[usize; 2]>, Result<(), ProbeError<&'static str>>) {
        let mut logged = Vec::new();
        let done = probe(&plan(), &steps(), SPEEDS, recorder, &mut |record| {
            logged.push([record.row.line, record.touch]);
            Ok(())
        });
        (logged, done)
    }

    #[test]
    fn every_touch_is_made_twice_and_logged_after_the_way_back() {
        let mut recorder = Recorder::default();
        let (logged, done) = probed(&mut recorder);
        assert_eq!(done, Ok(()));
        assert_eq!(logged, [[2, 1], [3, 2]]);
        let touch = ["touch 200", "retreat", "touch 30", "retreat"];
        let expected = [&["rapid"][..], &touch, &["near"], &touch].concat();
        assert_eq!(recorder.moves, expected);
    }

    #[test]
    fn what_stops_a_machine_stops_probing_and_only_whole_touches_are_logged() {
        for step in 1..=10 {
            let mut recorder = Recorder {
                fails_at: Some(step),
                ..Recorder::default()
            };
            let (logged, done) = probed(&mut recorder);
            assert_eq!(done, Err(ProbeError::Machine("stopped")), "step {step}");
            assert_eq!(recorder.moves.len(), step);
            assert_eq!(logged.len(), usize::from(step > 5), "step {step}");
        }
        for step in [2, 4, 7, 9] {
            let mut recorder = Recorder {
                finds_nothing_at: Some(step),
                ..Recorder::default()
            };
            let (logged, done) = probed(&mut recorder);
            let (line, touch) = if step < 6 { (2, 1) } else { (3, 2) };
            let ball = "1".to_owned();
            assert_eq!(done, Err(ProbeError::NoContact { line, ball, touch }));
            assert_eq!(logged.len(), usize::from(step > 5));
        }
    }

    #[test]
    fn a_log_that_cannot_be_written_stops_the_machine() {
        let mut recorder = Recorder::default();
        let full = |_: &TouchRecord<'_>| Err(std::io::Error::other("full"));
        let done = probe(&plan(), &steps(), SPEEDS, &mut recorder, &mut { full });
        assert_eq!(done, Err(ProbeError::Log("full".to_owned())));
        assert_eq!(recorder.moves.len(), 5);
    }

    #[test]
    fn the_second_touch_begins_near_the_first() {
        let contact: PerAxis = std::array::from_fn(|i| [3.0, 4.0, 9.0][i.min(2)]);
        let back = between(&contact, &vec![(0, 0.0), (1, 0.0)], 0.5);
        assert_eq!(back, [(0, 2.7), (1, 3.6)]);
    }
}
