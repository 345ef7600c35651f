//! What `linuxcnc start` takes from its options, and asks where these say nothing.

use super::{Arguments, FoundConfiguration};
use crate::commands::bad_input::BadInput;
use crate::commands::output;
use std::io::BufRead;
use std::path::PathBuf;
use trueaxis_direct::{Growth, ReadingError, Single};
use trueaxis_model::machine::Machine;

/// A temperature sensor.
pub(super) struct StartSensor {
    pub(super) name: String,
    /// Pin in HAL, °C.
    pub(super) pin: String,
}

/// A question for a reading of a simple instrument.
struct ReadingQuestion {
    text: String,
    /// Letters of the axes, as options have them before `=`.
    axes: String,
    parse: fn(&[char], &str) -> Result<Single, ReadingError>,
}

impl ReadingQuestion {
    fn read(&self, letters: &[char], answer: &str) -> Result<Single, BadInput> {
        (self.parse)(letters, &format!("{}={answer}", self.axes))
            .map_err(|error| BadInput::new(error.what, error.remedy))
    }
}

/// Scales, then squares, then dials, of all linear axes.
fn questions(machine: &Machine) -> Vec<ReadingQuestion> {
    let linear = machine.axes.iter().filter(|axis| !axis.letter.is_rotary());
    let linear: Vec<char> = linear.map(|axis| axis.letter.char()).collect();
    let scale = |letter: &char| ReadingQuestion {
        text: format!("Scale along {letter}: µm too much / mm of travel (2/100):"),
        axes: letter.to_string(),
        parse: Single::scale,
    };
    let square = |a: char, b: char| ReadingQuestion {
        text: format!(
            "Square, one leg aligned with {a}; a dial moved by {b} along the other reads towards {a}: µm / mm (3/100):"
        ),
        axes: format!("{a}{b}"),
        parse: Single::square,
    };
    let dial = |letter: &char| ReadingQuestion {
        text: format!("Dial along {letter}: reading after + less after − travel, µm:"),
        axes: letter.to_string(),
        parse: Single::dial,
    };
    let squares = (linear.iter().enumerate())
        .flat_map(|(k, a)| linear[k + 1..].iter().map(move |b| square(*a, *b)));
    (linear.iter().map(scale).chain(squares))
        .chain(linear.iter().map(dial))
        .collect()
}

/// What an operator writes; empty at the end of the input.
fn answered(question: &str) -> Result<String, BadInput> {
    output::print(&format!("{question} "))?;
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line);
    read.map_err(|error| {
        BadInput::new(
            format!("the answer cannot be read: {error}"),
            "answer in UTF-8, or give options",
        )
    })?;
    Ok(line.trim().to_owned())
}

/// A reading of an option that cannot be used.
fn reading(option: &str, error: ReadingError) -> BadInput {
    BadInput::new(format!("--{option}: {error}"), error.remedy)
}

impl Arguments {
    /// An answer, or nothing if nothing is to be asked.
    pub(super) fn ask(&self, question: &str) -> Result<String, BadInput> {
        match self.yes {
            true => Ok(String::new()),
            false => answered(question),
        }
    }

    pub(super) fn agrees(&self, question: &str) -> Result<bool, BadInput> {
        let answer = self.ask(&format!("{question} [y/N]"))?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }

    pub(super) fn ask_ini(&self) -> Result<PathBuf, BadInput> {
        let inis = std::fs::read_dir(".").into_iter().flatten().flatten();
        let inis = inis.map(|entry| PathBuf::from(entry.file_name()));
        let mut inis: Vec<PathBuf> = inis
            .filter(|path| path.extension().is_some_and(|e| e == "ini"))
            .collect();
        inis.sort();
        let proposed = match &inis[..] {
            [one] => format!(" [{}]", one.display()),
            _ => String::new(),
        };
        let answer = self.ask(&format!("INI file of the machine{proposed}:"))?;
        match (answer.is_empty(), &inis[..]) {
            (false, _) => Ok(answer.into()),
            (true, [one]) => Ok(one.clone()),
            (true, _) => Err(BadInput::new(
                "no INI file is given",
                "give the path of the INI file that LinuxCNC is started with",
            )),
        }
    }

    /// The file of balls that can be probed, if there are any.
    pub(super) fn ask_balls(&self) -> Result<Option<PathBuf>, BadInput> {
        let answer =
            self.ask("Balls on the table that can be probed: artefact file (artefact.toml):")?;
        Ok(Some(answer).filter(|a| !a.is_empty()).map(PathBuf::from))
    }

    /// The sensors, in the order in which the compensation has them: those of a growth first; and the growths.
    pub(super) fn temperatures(&self) -> Result<(Vec<StartSensor>, Vec<Growth>), BadInput> {
        let mut sensors: Vec<StartSensor> = Vec::new();
        for text in &self.temperature {
            let (name, pin) = text
                .split_once('=')
                .map_or(("", ""), |(n, p)| (n.trim(), p.trim()));
            let is_other = sensors.iter().all(|sensor| sensor.name != name);
            if name.is_empty() || pin.is_empty() || pin.contains(char::is_whitespace) || !is_other {
                return Err(BadInput::new(
                    format!("--temperature: `{text}` is not NAME=PIN with a name of its own"),
                    "give a name and a HAL pin: --temperature bearing=hm2_7i76e.0.thermistor.00",
                ));
            }
            sensors.push(StartSensor {
                name: name.to_owned(),
                pin: pin.to_owned(),
            });
        }
        let names = || sensors.iter().map(|sensor| sensor.name.as_str());
        let growths = self.growth.iter().map(|text| Growth::parse(names(), text));
        let growths: Vec<Growth> = growths
            .collect::<Result<_, _>>()
            .map_err(|error| reading("growth", error))?;
        let at = |sensor: &StartSensor| {
            let mut growths_of = growths.iter();
            let first = growths_of.position(|growth| growth.sensor == sensor.name);
            first.unwrap_or(growths.len())
        };
        sensors.sort_by_key(at);
        Ok((sensors, growths))
    }

    /// What has been measured, from options; axes count as their letters do.
    pub(super) fn given(&self, letters: &[char]) -> Result<Vec<Single>, BadInput> {
        let scale = |text| Single::scale(letters, text).map_err(|error| reading("scale", error));
        let square = |text| Single::square(letters, text).map_err(|error| reading("square", error));
        let dial = |text| Single::dial(letters, text).map_err(|error| reading("dial", error));
        let scales = self.scale.iter().map(|text| scale(text));
        let squares = self.square.iter().map(|text| square(text));
        let dials = self.dial.iter().map(|text| dial(text));
        scales.chain(squares).chain(dials).collect()
    }

    /// What has been measured, from options or by asking.
    pub(super) fn singles(
        &self,
        machine: &Machine,
        found: &FoundConfiguration<'_>,
        base: Option<&str>,
    ) -> Result<Vec<Single>, BadInput> {
        let letters: Vec<char> = machine.axes.iter().map(|axis| axis.letter.char()).collect();
        let free = |single: &Single| found.is_free(&letters, single, base);
        let mut singles = self.given(&letters)?;
        singles.iter().try_for_each(free)?;
        for doubt in singles.iter().filter_map(|single| single.doubt(&letters)) {
            eprintln!("warning: {doubt}");
        }
        if self.yes || !singles.is_empty() {
            return Ok(singles);
        }
        output::print(
            "\nWhat has been measured? Positive is where the tool is farther in the direction of a positive command.\n\
             An empty line where there is nothing.\n",
        )?;
        for question in questions(machine) {
            singles.extend(self.single(&question, |answer| {
                let single = question.read(&letters, answer)?;
                if let Some(doubt) = single.doubt(&letters) {
                    eprintln!("warning: {doubt}");
                }
                free(&single).map(|()| single)
            })?);
        }
        Ok(singles)
    }

    /// Asks again until the answer can be read; none if it is empty.
    fn single(
        &self,
        question: &ReadingQuestion,
        read: impl Fn(&str) -> Result<Single, BadInput>,
    ) -> Result<Option<Single>, BadInput> {
        loop {
            let answer = self.ask(&question.text)?;
            if answer.is_empty() {
                return Ok(None);
            }
            match read(&answer) {
                Ok(single) => return Ok(Some(single)),
                Err(bad) => output::print(&format!("{bad}\n"))?,
            }
        }
    }
}
