//! A submission: a folder with answers for machines of a round.

use crate::answer::{Answer, Cost, Stated};
use crate::baseline::evaluated;
use crate::export::{folder, mark};
use crate::run::scored;
use crate::table::Scored;
use crate::task::{Hidden, Task};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::{fs, io};
use toml::Spanned;
use trueaxis::AlignedBlob;
use trueaxis_model::errors::Parameter;
use trueaxis_model::formats::csv::CsvTable;
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::source::FileError;
use trueaxis_model::validate::Runtime;

const HEADING: &str = "submission.toml";
const BLOB: &str = "compensation.trax";
const CORRECTIONS: &str = "corrections.csv";
const BANDS: &str = "bands.csv";
const PARAMETERS: &str = "parameters.csv";

/// Why a submission is refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// The file.
    pub path: PathBuf,
    /// The line, counted from 1.
    pub line: Option<usize>,
    /// What is wrong.
    pub cause: String,
    /// What to write instead.
    pub remedy: String,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, " line {line}")?;
        }
        write!(f, ": {}; {}", self.cause, self.remedy)
    }
}

impl std::error::Error for Refused {}

impl Refused {
    fn whole(path: &Path, cause: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            path: path.to_owned(),
            line: None,
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }

    fn of(path: &Path, text: &str, error: FileError) -> Self {
        Self {
            path: path.to_owned(),
            line: error.line(text),
            cause: error.message,
            remedy: error.remedy,
        }
    }
}

/// `submission.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heading {
    name: Spanned<String>,
    round: Spanned<String>,
}

/// The name of the scores without any correction.
const NONE: &str = "none";

/// Scores the submission in a folder, beside no correction, on the first `count` machines of a round. A machine without a folder counts as not
/// corrected.
///
/// # Errors
/// [`Refused`]: a file that cannot be read, another round.
pub fn score(path: &Path, round: u64, count: usize) -> Result<Vec<Scored>, Refused> {
    let heading = heading(path, &mark(&Hidden::new(round, 0).task))?;
    let one = |number: usize| {
        let hidden = Hidden::new(round, number);
        let own = path.join(folder(number));
        let answer = match own.is_dir() {
            false => Err("there is no answer".to_owned()),
            true => Ok(read(&own, &hidden.task)?),
        };
        let none = Ok(Answer::none(hidden.task.positions.len()));
        Ok([
            scored(&hidden, NONE.to_owned(), none),
            scored(&hidden, heading.name.get_ref().clone(), answer),
        ])
    };
    let each: Result<Vec<_>, Refused> = (0..count).into_par_iter().map(one).collect();
    Ok(each?.into_iter().flatten().collect())
}

fn heading(path: &Path, mark: &str) -> Result<Heading, Refused> {
    let path = path.join(HEADING);
    let remedy = "write it with name = \"…\" and the round of arena.toml";
    let text = text(&path)?.ok_or_else(|| Refused::whole(&path, "it is missing", remedy))?;
    let heading: Heading = toml::from_str(&text)
        .map_err(|error| Refused::of(&path, &text, FileError::syntax(&error, &text)))?;
    let name = heading.name.get_ref();
    if name.is_empty() || name == NONE || name.contains(['|', ',', '\n']) {
        let cause = format!("the name `{name}` is taken or does not fit into a table");
        let error = FileError::at(heading.name.span(), cause, "here", "write another name");
        return Err(Refused::of(&path, &text, error));
    }
    if heading.round.get_ref() != mark {
        let error = FileError::at(
            heading.round.span(),
            format!(
                "round {} is not that of this seed, {mark}",
                heading.round.get_ref()
            ),
            "here",
            "score it with --seed and the seed with which the round was exported",
        );
        return Err(Refused::of(&path, &text, error));
    }
    Ok(heading)
}

/// The text of a file, or `None` if there is none.
fn text(path: &Path) -> Result<Option<String>, Refused> {
    match fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Refused::whole(
            path,
            error.to_string(),
            "write a text file in UTF-8 that can be read",
        )),
    }
}

/// The answer in the folder of a machine.
///
/// # Errors
/// [`Refused`].
pub fn read(path: &Path, task: &Task) -> Result<Answer, Refused> {
    let with = |name: &str, read: &dyn Fn(&str) -> Result<(), FileError>| {
        let path = path.join(name);
        let Some(text) = text(&path)? else {
            return Ok(false);
        };
        read(&text).map_err(|error| Refused::of(&path, &text, error))?;
        Ok(true)
    };
    let answer = std::cell::RefCell::new(Answer::none(task.positions.len()));
    let is_listed = with(CORRECTIONS, &|text| {
        answer.borrow_mut().corrections = corrections(text, task)?;
        Ok(())
    })?;
    with(BANDS, &|text| {
        answer.borrow_mut().bands = bands(text, task)?;
        Ok(())
    })?;
    with(PARAMETERS, &|text| {
        answer.borrow_mut().parameters = parameters(text, task)?;
        Ok(())
    })?;
    let mut answer = answer.into_inner();
    let blob = path.join(BLOB);
    match (is_listed, blob.is_file()) {
        (true, false) => {}
        (false, true) => compensated(&blob, task, &mut answer)?,
        (true, true) => {
            let cause = format!("{BLOB} and {CORRECTIONS} are both there");
            return Err(Refused::whole(path, cause, "leave out one of them"));
        }
        (false, false) => {
            let cause = format!("there is neither {BLOB} nor {CORRECTIONS}");
            let remedy =
                "write one of them, or leave out the folder if the machine is not corrected";
            return Err(Refused::whole(path, cause, remedy));
        }
    }
    Ok(answer)
}

/// Takes corrections and cost from a compensation.
fn compensated(path: &Path, task: &Task, answer: &mut Answer) -> Result<(), Refused> {
    let remedy = "write it with `trueaxis compile` for the machine.toml of this folder";
    let refused = |cause: String| Refused::whole(path, cause, remedy);
    let bytes = fs::read(path).map_err(|error| refused(error.to_string()))?;
    let blob = AlignedBlob::from_bytes(&bytes);
    let runtime = Runtime::load(&blob).map_err(|error| refused(error.to_string()))?;
    let axes = runtime.compensation().axes().iter();
    let axes: String = axes.map(|axis| char::from(axis.name)).collect();
    let own: String = task.machine.axes.iter().map(|a| a.letter.char()).collect();
    if axes != own {
        let cause = format!("it is for a machine with the axes {axes}, this one has {own}");
        return Err(refused(cause));
    }
    answer.corrections = evaluated(task, &runtime).map_err(refused)?;
    answer.cost = Some(Cost::of(&runtime));
    Ok(())
}

/// Refuses a file that does not have a row for each position.
fn for_each_position(rows: usize, task: &Task) -> Result<(), FileError> {
    let wanted = task.positions.len();
    match rows == wanted {
        true => Ok(()),
        false => Err(FileError::whole(
            format!("there are {rows} rows for {wanted} positions"),
            "write a row for each row of positions.csv, in the same order",
        )),
    }
}

const ROWS: &str = "write a number in each column, with a decimal point";

/// Largest correction (mm, deg) and largest band (µm, µrad): beyond these a number is in another unit.
const LARGEST: f64 = 100.0;
const WIDEST: f64 = 1e6;

fn corrections(text: &str, task: &Task) -> Result<Vec<PerAxis>, FileError> {
    let letters: Vec<String> = task
        .machine
        .axes
        .iter()
        .map(|a| a.letter.to_string())
        .collect();
    let layout = format!(
        "write the header {}: corrections in mm and degrees",
        letters.join(",")
    );
    let table = CsvTable::open(text, 0, layout, ROWS)?;
    let columns = table.columns(0, |name| letters.iter().position(|l| l == name))?;
    for (axis, letter) in letters.iter().enumerate() {
        if !columns.contains(&axis) {
            return Err(table.missing(letter));
        }
    }
    let mut corrections = Vec::new();
    for row in table {
        let row = row?;
        let mut command = [0.0; MAX_AXES];
        for (column, axis) in columns.iter().enumerate() {
            let value = row.number(column)?;
            if value.abs() > LARGEST {
                let cause = format!("a correction of {value} (mm or deg) is too large");
                return Err(row.error(column, cause, "here", ROWS));
            }
            command[*axis] = value;
        }
        corrections.push(task.machine.to_kinematic(&command));
    }
    for_each_position(corrections.len(), task)?;
    Ok(corrections)
}

/// A number that is not negative, and not too large for its unit.
fn not_negative(
    row: &trueaxis_model::formats::csv::CsvRow<'_>,
    column: usize,
    most: f64,
) -> Result<f64, FileError> {
    let value = row.number(column)?;
    match (0.0..=most).contains(&value) {
        true => Ok(value),
        false => Err(row.error(
            column,
            format!("a band cannot be {value}"),
            "here",
            "write the half-width of the interval of 95 %, which is not negative",
        )),
    }
}

fn bands(text: &str, task: &Task) -> Result<Vec<[f64; 2]>, FileError> {
    let table = CsvTable::open(text, 0, "write the header band_um,band_urad", ROWS)?;
    table.begins_with(&["band_um", "band_urad"])?;
    let mut bands = Vec::new();
    for row in table {
        let row = row?;
        let [um, urad] = [0, 1].map(|column| not_negative(&row, column, WIDEST));
        bands.push([um? * 1e-3, urad? * 1e-6]);
    }
    for_each_position(bands.len(), task)?;
    Ok(bands)
}

fn parameters(text: &str, task: &Task) -> Result<BTreeMap<Parameter, Stated>, FileError> {
    let layout =
        "write the header parameter,value,band: values and bands in the units of error files";
    let table = CsvTable::open(text, 0, layout, ROWS)?;
    table.begins_with(&["parameter", "value", "band"])?;
    let mut parameters = BTreeMap::new();
    for row in table {
        let row = row?;
        let name = row.text(0)?;
        let parameter = Parameter::parse(name).filter(|p| task.asked.contains(p));
        let parameter = parameter.ok_or_else(|| {
            let cause = format!("`{name}` is not asked for");
            row.error(0, cause, "here", "give the parameters of asked.csv")
        })?;
        let stated = Stated {
            value: row.number(1)?,
            band: not_negative(&row, 2, f64::MAX)?,
        };
        if parameters.insert(parameter, stated).is_some() {
            let cause = format!("`{name}` is there twice");
            return Err(row.error(0, cause, "here", "give each parameter once"));
        }
    }
    Ok(parameters)
}
