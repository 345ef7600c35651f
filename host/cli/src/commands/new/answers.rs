//! The answers of `trueaxis new`: from options, or from a person.

use super::super::bad_input::BadInput;
use super::kinds::{self, KINDS};
use clap::ValueEnum;
use std::fmt::Write as _;
use std::io::{BufRead, Write};

/// Unit of lengths in the answers.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum AnswerUnit {
    /// Millimetres
    Mm,
    /// Inches, which are written as mm
    Inch,
}

impl AnswerUnit {
    pub fn mm(self, length: f64) -> f64 {
        match self {
            Self::Mm => length,
            // 25.4 is not a binary number: without the digits of rounding.
            Self::Inch => (length * 25.4e6).round() / 1e6,
        }
    }
}

/// An axis of the new machine.
#[derive(Clone, Debug, PartialEq)]
pub struct NewAxis {
    pub letter: char,
    pub carries_workpiece: bool,
    /// In mm or degrees.
    pub range: [f64; 2],
    /// A point of a rotary axis (mm).
    pub origin: [f64; 3],
}

impl NewAxis {
    pub fn is_rotary(&self) -> bool {
        "ABC".contains(self.letter)
    }
}

/// The axes of a layout, each branch from the foundation outwards, the workpiece's first. Rotary axes have their usual
/// travels, linear ones none yet.
pub fn layout(text: &str) -> Result<Vec<NewAxis>, String> {
    let bad = || {
        format!(
            "`{text}` is not a layout: write w, the axes that carry the workpiece, F, the axes that carry the tool, and St, like wXYFZSt"
        )
    };
    let inner = text
        .strip_prefix('w')
        .and_then(|text| text.strip_suffix('t'));
    let inner = inner.map(|text| text.strip_suffix('S').unwrap_or(text));
    let (workpiece, tool) = inner
        .and_then(|text| text.split_once('F'))
        .ok_or_else(bad)?;
    let axis = |carries_workpiece| {
        move |letter| NewAxis {
            letter,
            carries_workpiece,
            range: match letter {
                'A' | 'B' => [-120.0, 120.0],
                'C' => [-360.0, 360.0],
                _ => [0.0, 0.0],
            },
            origin: [0.0; 3],
        }
    };
    let workpiece = workpiece.chars().rev().map(axis(true));
    let axes: Vec<NewAxis> = workpiece.chain(tool.chars().map(axis(false))).collect();
    if axes.is_empty() || axes.iter().any(|axis| !"XYZUVWABC".contains(axis.letter)) {
        return Err(bad());
    }
    let twice = |k: &usize| axes[..*k].iter().any(|axis| axis.letter == axes[*k].letter);
    match (0..axes.len()).find(twice) {
        None => Ok(axes),
        Some(k) => Err(format!("`{text}` has the axis {} twice", axes[k].letter)),
    }
}

/// Sets travels: `X=500` is centred on zero, or ends there on Z; `X=0:500` has its ends.
pub fn travels(text: &str, axes: &mut [NewAxis], unit: AnswerUnit) -> Result<(), String> {
    for part in text.split(',') {
        let (letter, value) = assigned(part)?;
        let axis = of_letter(axes, letter)?;
        let number = |text: &str| number(text, part);
        let ends = match value.split_once(':') {
            Some((low, high)) => [number(low)?, number(high)?],
            None => match (number(value)?, letter) {
                (length, 'Z') => [-length, 0.0],
                (length, _) => [-length / 2.0, length / 2.0],
            },
        };
        if ends[0] >= ends[1] {
            return Err(format!(
                "`{part}` has no length: write the lower end first, like X=0:500"
            ));
        }
        axis.range = match axis.is_rotary() {
            true => ends,
            false => ends.map(|end| unit.mm(end)),
        };
    }
    let missing = axes.iter().filter(|axis| axis.range == [0.0, 0.0]);
    let missing: Vec<String> = missing.map(|axis| format!("{}=500", axis.letter)).collect();
    match missing.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "travels are missing: write {} as well",
            missing.join(",")
        )),
    }
}

/// Sets a point of a rotary axis: `C=0,0,-50`.
pub fn origin(text: &str, axes: &mut [NewAxis], unit: AnswerUnit) -> Result<(), String> {
    let (letter, value) = assigned(text)?;
    let axis = of_letter(axes, letter)?;
    if !axis.is_rotary() {
        return Err(format!("{letter} is not a rotary axis"));
    }
    let numbers: Result<Vec<f64>, String> = value.split(',').map(|n| number(n, text)).collect();
    axis.origin = <[f64; 3]>::try_from(numbers?)
        .map_err(|_| format!("`{text}` is not a point: write x, y and z, like C=0,0,-50"))?
        .map(|length| unit.mm(length));
    Ok(())
}

fn assigned(part: &str) -> Result<(char, &str), String> {
    let bad = || format!("`{part}` is not an axis with its value: write it like X=500");
    let (name, value) = part.split_once('=').ok_or_else(bad)?;
    let mut letters = name.trim().chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => Ok((letter.to_ascii_uppercase(), value.trim())),
        _ => Err(bad()),
    }
}

fn of_letter(axes: &mut [NewAxis], letter: char) -> Result<&mut NewAxis, String> {
    let known: String = axes.iter().map(|axis| axis.letter).collect();
    let found = axes.iter_mut().find(|axis| axis.letter == letter);
    found.ok_or_else(|| format!("the layout has no axis {letter}, only {known}"))
}

fn number(text: &str, part: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|n: &f64| n.abs() <= 1e5);
    number.ok_or_else(|| {
        format!("`{text}` in `{part}` is not a number up to 1e5: write it with a decimal point")
    })
}

/// What the files are made from.
pub struct Answers {
    pub layout: String,
    pub axes: Vec<NewAxis>,
    pub unit: AnswerUnit,
}

/// What was given as options.
pub struct GivenOptions<'a> {
    pub kind: Option<&'a str>,
    pub layout: Option<&'a str>,
    pub unit: Option<AnswerUnit>,
    pub travel: Option<&'a str>,
    pub rotary: &'a [String],
}

impl GivenOptions<'_> {
    /// The answers by options alone.
    pub fn answers(&self) -> Result<Answers, BadInput> {
        let topology = self.kind.and_then(kinds::named).map(|kind| kind.topology);
        let given = [
            ("--kind", self.layout.or(topology).is_some()),
            ("--travel", self.travel.is_some()),
        ];
        let missing = given.iter().filter(|(_, is_given)| !is_given);
        let missing: Vec<&str> = missing.map(|(option, _)| *option).collect();
        let (Some(layout), Some(travel)) = (self.layout.or(topology), self.travel) else {
            return Err(BadInput::new(
                format!(
                    "{} missing, and there is no terminal to ask at",
                    missing.join(" and ")
                ),
                "give them as in `trueaxis new --kind mill --travel X=500,Y=300,Z=400`; --list has the kinds",
            ));
        };
        let bad = |option: &'static str| {
            move |cause: String| {
                BadInput::new(format!("{option}: {cause}"), "see `trueaxis new --help`")
            }
        };
        let unit = self.unit.unwrap_or(AnswerUnit::Mm);
        let mut axes = self::layout(layout).map_err(bad("--layout"))?;
        travels(travel, &mut axes, unit).map_err(bad("--travel"))?;
        for text in self.rotary {
            origin(text, &mut axes, unit).map_err(bad("--rotary"))?;
        }
        Ok(Answers {
            layout: layout.to_owned(),
            axes,
            unit,
        })
    }

    /// Asks for what was not given; asks again after a wrong answer.
    pub fn ask(&self, from: &mut dyn BufRead, to: &mut dyn Write) -> Result<Answers, BadInput> {
        let mut person = Person { from, to };
        let layout = self.layout_asked(&mut person)?;
        let wrong = |remedy: &'static str| move |cause: String| BadInput::new(cause, remedy);
        let mut axes = self::layout(&layout).map_err(wrong("correct --layout"))?;
        let unit = match self.unit {
            Some(unit) => unit,
            None => person.answer("Unit of lengths, mm or inch", "mm", |text| {
                AnswerUnit::from_str(text, true)
            })?,
        };
        match self.travel {
            Some(text) => {
                travels(text, &mut axes, unit).map_err(wrong("correct --travel"))?;
            }
            None => axes = person.travels(&axes, unit)?,
        }
        for text in self.rotary {
            origin(text, &mut axes, unit).map_err(wrong("correct --rotary"))?;
        }
        if self.rotary.is_empty() {
            axes = person.origins(axes, unit)?;
        }
        Ok(Answers { layout, axes, unit })
    }

    fn layout_asked(&self, person: &mut Person<'_>) -> Result<String, BadInput> {
        let mut kind = self.kind.map(str::to_owned);
        if kind.is_none() && self.layout.is_none() {
            let name = |text: &str| match kinds::named(text) {
                Some(kind) => Ok(kind.name.to_owned()),
                None => Err(format!("`{text}` is not in the list")),
            };
            kind = Some(person.answer(&format!("{}Kind", list()), "mill", name)?);
        }
        let usual = kind
            .as_deref()
            .and_then(kinds::named)
            .map_or("", |kind| kind.topology);
        match self.layout {
            Some(layout) => Ok(layout.to_owned()),
            None => person.answer(
                "Layout: w, the axes that carry the workpiece, F, the axes that carry the tool, St",
                usual,
                |text| self::layout(text).map(|_| text.to_owned()),
            ),
        }
    }
}

/// The kinds, one a line.
pub fn list() -> String {
    let mut text = String::new();
    for kind in &KINDS {
        let _ = writeln!(
            text,
            "{:<16} {:<10} {}",
            kind.name, kind.topology, kind.words
        );
    }
    text
}

/// Who answers questions.
struct Person<'a> {
    from: &'a mut dyn BufRead,
    to: &'a mut dyn Write,
}

impl Person<'_> {
    /// The axes with their travels.
    fn travels(&mut self, axes: &[NewAxis], unit: AnswerUnit) -> Result<Vec<NewAxis>, BadInput> {
        let linear = axes.iter().filter(|axis| !axis.is_rotary());
        let example: Vec<String> = linear.map(|axis| format!("{}=500", axis.letter)).collect();
        let question = "Travels: a length, or both ends as in X=0:500";
        self.answer(question, &example.join(","), |text| {
            let mut axes = axes.to_vec();
            travels(text, &mut axes, unit).map(|()| axes)
        })
    }

    /// The axes with a point of each rotary one.
    fn origins(
        &mut self,
        mut axes: Vec<NewAxis>,
        unit: AnswerUnit,
    ) -> Result<Vec<NewAxis>, BadInput> {
        let rotary = axes.iter().filter(|axis| axis.is_rotary());
        for letter in rotary.map(|axis| axis.letter).collect::<Vec<_>>() {
            let question = format!("Point x,y,z through which {letter} turns, with all axes at 0");
            axes = self.answer(&question, "0,0,0", |text| {
                let mut axes = axes.clone();
                origin(&format!("{letter}={text}"), &mut axes, unit).map(|()| axes)
            })?;
        }
        Ok(axes)
    }

    /// The first right answer; an empty line is the usual one.
    fn answer<T>(
        &mut self,
        question: &str,
        usual: &str,
        of: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, BadInput> {
        loop {
            let mut line = String::new();
            let asked = write!(self.to, "{question} [{usual}]: ").and_then(|()| self.to.flush());
            let read = asked.and_then(|()| self.from.read_line(&mut line));
            match read {
                Ok(0) | Err(_) => {
                    return Err(BadInput::new(
                        "the questions were not answered, and nothing is written",
                        "answer them, or give options: see `trueaxis new --help`",
                    ));
                }
                Ok(_) => {}
            }
            let answer = match line.trim() {
                "" => usual,
                given => given,
            };
            match of(answer) {
                Ok(found) => return Ok(found),
                Err(cause) => {
                    let _ = writeln!(self.to, "{cause}");
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_are_asked_until_they_are_answered() {
        let given = GivenOptions {
            kind: None,
            layout: None,
            unit: None,
            travel: None,
            rotary: &[],
        };
        let answers = "tank\ntrunnion\n\ninch\nX=20\nX=20,Y=10,Z=0:10\n0,0,-2\n\n";
        let mut said = Vec::new();
        let found = given.ask(&mut answers.as_bytes(), &mut said).unwrap();
        let said = String::from_utf8(said).unwrap();
        assert!(said.contains("`tank` is not in the list"), "{said}");
        assert!(
            said.contains("travels are missing: write Y=500,Z=500 as well"),
            "{said}"
        );
        assert_eq!(found.layout, "wCAYFXZSt");
        let ranges: Vec<_> = found.axes.iter().map(|a| (a.letter, a.range)).collect();
        assert_eq!(
            ranges,
            [
                ('Y', [-127.0, 127.0]),
                ('A', [-120.0, 120.0]),
                ('C', [-360.0, 360.0]),
                ('X', [-254.0, 254.0]),
                ('Z', [0.0, 254.0]),
            ]
        );
        assert_eq!(found.axes[1].origin, [0.0, 0.0, -50.8]);
        let silent = given.ask(&mut "mill\n".as_bytes(), &mut Vec::new());
        assert!(silent.is_err());
    }
}
