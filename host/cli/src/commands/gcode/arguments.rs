//! What `trueaxis gcode` is told.

use crate::commands::bad_input::BadInput;
use crate::commands::files::Text;
use crate::commands::output;
use clap::{Args, ValueEnum};
use std::io::BufRead;
use std::path::{Path, PathBuf};
use trueaxis::Header;
use trueaxis_gcode::modal::Units;
use trueaxis_gcode::{self as gcode, Dialect, JobError, Rules, Setup, Tables};

/// Correct a program before it runs, for a controller that has no compensation
///
/// Words become positions of the machine, positions are corrected by the compensation and written as words again.
/// Moves are cut where the correction bends them, arcs stay arcs where they can; everything else is passed byte for
/// byte. Parameters, expressions and O-words are refused: LinuxCNC's component corrects what such programs move.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis gcode part.ngc -o part-corrected.ngc --compensation mill.trax --setup setup.toml\n\n\
The setup says what the program does not:\n  units = \"mm\"\n  [start]            # machine position before the first line\n  X = 0.0\n  \
Y = 0.0\n  Z = 0.0\n  [offset.G54]       # machine position of the program's zero\n  X = -250.0\n  Y = -180.0\n  Z = -320.0\n  \
[tool.1]\n  length = 112.4"
)]
pub struct Arguments {
    /// The program
    #[arg(value_name = "IN")]
    pub program: PathBuf,
    /// Where to write the corrected program
    #[arg(short, long, value_name = "OUT", required_unless_present = "in_place")]
    output: Option<PathBuf>,
    /// Replace the program by the corrected one, as slicers expect of a post-processing script
    #[arg(long, conflicts_with = "output")]
    pub in_place: bool,
    /// The compensation
    #[arg(long, value_name = "FILE.trax")]
    pub compensation: PathBuf,
    /// Offsets, tools, and where the machine stands before the first line (TOML)
    #[arg(long, value_name = "SETUP.toml")]
    setup: Option<PathBuf>,
    /// Offsets as LinuxCNC stores them, in the units of --setup or --units
    #[arg(long, value_name = "FILE.var")]
    var: Option<PathBuf>,
    /// Tools as LinuxCNC stores them, in the units of --setup or --units
    #[arg(long, value_name = "FILE.tbl")]
    pub tools: Option<PathBuf>,
    /// Units of the machine, where no setup gives them
    #[arg(long, value_enum, conflicts_with = "setup")]
    units: Option<Units>,
    /// Machine description: for programs with tool-centre-point control
    #[arg(long, value_name = "machine.toml")]
    pub machine: Option<PathBuf>,
    /// Error parameters: with --machine and --check, what the tool does before and after if the machine has these errors and no others
    #[arg(
        long,
        value_name = "errors.toml",
        requires = "machine",
        requires = "check"
    )]
    pub errors: Option<PathBuf>,
    /// Read both programs anew and compare: distance from the corrected path, times, errors of the tool
    #[arg(long)]
    pub check: bool,
    /// Whose language the program is in
    #[arg(long, value_enum, default_value_t)]
    dialect: Dialect,
    /// How far straight moves may be from the corrected path (µm, 0.3 at least)
    #[arg(long, value_name = "UM", default_value_t = 0.5)]
    tolerance: f64,
    /// How far a hole of a canned cycle may be from its corrected place, anywhere along it (µm)
    #[arg(long, value_name = "UM", default_value_t = 5.0)]
    hole_tolerance: f64,
    /// Decimals of words in mm and degrees; words in inches get one more (3 and 4 for fanuc and haas, otherwise 4, 5
    /// and 6)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=6))]
    decimals: Option<u8>,
    /// Give inserted lines a sub-number of their line: N10.1
    #[arg(long)]
    sub_numbers: bool,
    /// Sagitta of the chords that replace what no arc can follow (µm)
    #[arg(long, value_name = "UM", default_value_t = 1.0)]
    chord: f64,
    /// How the program takes the step of direction-dependent tables where an axis reverses
    #[arg(long, value_enum, default_value_t)]
    backlash: gcode::Backlash,
    /// Cut moves under G41 and G42 too, where the correction bends them: the controller must look ahead far enough
    #[arg(long)]
    cut_under_g41: bool,
    /// Words are workpiece coordinates from the first line on (tool-centre-point control)
    #[arg(long, requires = "machine")]
    pub tcp: bool,
    /// How the switch for lines behind `/` stands: on leaves them out
    #[arg(long, value_enum, value_name = "SWITCH")]
    block_delete: Option<Switch>,
    /// Pass a G or M word that is not known: it must move nothing and change no coordinates
    #[arg(long, value_name = "WORD")]
    pass: Vec<String>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Switch {
    On,
    Off,
}

/// The least tolerance (µm): rounding words of three axes to 0.1 µm takes 0.09 of it.
const LEAST_TOLERANCE: f64 = 0.3;

/// Refuses what is no word with G or M, or is not written as programs are compared.
fn is_passable(word: &str) -> Result<(), BadInput> {
    let number = match word.as_bytes() {
        [b'G' | b'M' | b'g' | b'm', rest @ ..] => std::str::from_utf8(rest).ok(),
        _ => None,
    };
    let number = number.filter(|n| n.bytes().all(|b| b.is_ascii_digit() || b == b'.'));
    let value = number.and_then(|n| n.parse::<f64>().ok());
    let plain = value.map(|value| format!("{}{value}", &word[..1]));
    if plain.as_deref() == Some(word) {
        return Ok(());
    }
    let example = plain.unwrap_or_else(|| "G187 or --pass M100".to_owned());
    Err(BadInput::new(
        format!("--pass {word}: no word of a program is that"),
        format!("give a letter G or M and its number, without zeros before it: --pass {example}"),
    ))
}

impl Arguments {
    /// Where the corrected program goes.
    pub fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(&self.program)
    }

    /// Refuses an output that cannot be written.
    pub fn prepare(&self) -> Result<(), BadInput> {
        if output::is_screen(self.output()) {
            return Err(BadInput::new(
                "-o -: a program is read back and checked after it is written, and does not go to the screen",
                "give -o the name of a file",
            ));
        }
        output::prepare(self.output(), &self.inputs())
    }

    pub fn options(&self) -> Result<gcode::Options, BadInput> {
        for (name, value, least) in [
            ("--tolerance", self.tolerance, LEAST_TOLERANCE),
            ("--hole-tolerance", self.hole_tolerance, LEAST_TOLERANCE),
            ("--chord", self.chord, 0.01),
        ] {
            if !(least..=1000.0).contains(&value) {
                return Err(BadInput::new(
                    format!("{name} {value}: no length between {least} and 1000 µm"),
                    format!("write for example {name} 0.5"),
                ));
            }
        }
        self.pass.iter().try_for_each(|word| is_passable(word))?;
        let decimals = self.decimals.map(usize::from);
        Ok(gcode::Options {
            tolerance: self.tolerance * 1e-3,
            chord: self.chord * 1e-3,
            hole_tolerance: self.hole_tolerance * 1e-3,
            decimals: decimals.or(self.dialect.table().decimals),
            sub_numbers: self.sub_numbers,
            backlash: self.backlash,
            cut_under_cutter: self.cut_under_g41,
            ..gcode::Options::default()
        })
    }

    /// Setup, parameters and tools together.
    pub fn read_setup(&self) -> Result<Setup, BadInput> {
        let mut setup = match &self.setup {
            None => Setup::default(),
            Some(path) => {
                let text = Text::read(path)?;
                Setup::from_toml(&text.text).map_err(|e| text.bad(e))?
            }
        };
        setup.units = self.units.or(setup.units);
        if let Some(path) = &self.var {
            let units = units_of(&setup, "--var")?;
            let text = Text::read(path)?;
            setup.add_var(&text.text, units).map_err(|e| text.bad(e))?;
        }
        if let Some(path) = &self.tools {
            let units = units_of(&setup, "--tools")?;
            let text = Text::read(path)?;
            for (line, remark) in setup.add_tools(&text.text, units) {
                eprintln!("warning: {}, line {line}: {remark}", path.display());
            }
        }
        Ok(setup)
    }

    pub fn rules(&self, setup: Setup, tables: &Tables<'_>) -> Rules {
        Rules {
            dialect: self.dialect,
            setup,
            axes: tables.axes,
            endless: tables.endless(),
            pass: self.pass.clone(),
            block_delete: self.block_delete.map(|switch| matches!(switch, Switch::On)),
            tip: self.tcp,
            machine: String::new(),
            has_machine: false,
            no_tip: None,
        }
    }

    /// What cannot be corrected with, with the file that it is about.
    pub fn bad_job(&self, error: &JobError) -> BadInput {
        let about = match error {
            JobError::Tables(_) => Some(&self.compensation),
            JobError::OtherMachine { .. } => self.machine.as_ref(),
            JobError::NoTip(_) => None,
        };
        let about = about.map_or(String::new(), |path| format!("{}: ", path.display()));
        BadInput::new(format!("{about}{error}"), error.remedy())
    }

    /// The files that are read.
    pub fn inputs(&self) -> Vec<&Path> {
        let optional = [
            &self.setup,
            &self.var,
            &self.tools,
            &self.machine,
            &self.errors,
        ];
        let mut inputs = vec![self.compensation.as_path()];
        inputs.extend((!self.in_place).then_some(self.program.as_path()));
        inputs.extend(optional.into_iter().flatten().map(PathBuf::as_path));
        inputs
    }

    /// What the first comment says.
    pub fn mark(
        &self,
        blob: &[u8],
        compensation: &trueaxis::Largest<'_>,
        tables: &Tables<'_>,
    ) -> Result<String, BadInput> {
        let header = Header::read(blob).map_err(|e| BadInput::in_blob(e, &self.compensation))?;
        let setup = [&self.setup, &self.var, &self.tools].into_iter().flatten();
        let setup: Vec<String> = setup.map(|path| name_of(path)).collect();
        let setup = if setup.is_empty() {
            "none".to_owned()
        } else {
            setup.join(" ")
        };
        let machine = plain(compensation.machine());
        let name = name_of(&self.compensation);
        let backlash = match self.backlash.to_possible_value() {
            Some(value) if self.backlash != gcode::Backlash::Move && tables.directional != 0 => {
                format!(", backlash {}", value.get_name())
            }
            _ => String::new(),
        };
        let (original, sum) = (name_of(&self.program), checksum(&self.program)?);
        Ok(format!(
            "trueaxis corrected: {original} {sum:08x}, compensation {name} {:08x}, machine {machine}, setup {setup}{backlash}",
            header.crc
        ))
    }
}

pub fn units_of(setup: &Setup, option: &str) -> Result<Units, BadInput> {
    setup.units.ok_or_else(|| {
        BadInput::new(
            format!("{option}: mm or inches is unknown"),
            "give --units mm or --units inch, as [TRAJ] LINEAR_UNITS of the machine's INI file",
        )
    })
}

/// Of a whole file, as `crc32` and ZIP archives have it.
fn checksum(path: &Path) -> Result<u32, BadInput> {
    static CRC: crc::Crc<u32, crc::Table<16>> =
        crc::Crc::<u32, crc::Table<16>>::new(&crc::CRC_32_ISO_HDLC);
    let (mut digest, mut reader) = (CRC.digest(), super::open(path)?);
    loop {
        let read = reader.fill_buf().map_err(|error| {
            BadInput::new(
                format!("{}: cannot be read: {error}", path.display()),
                "give the path of a readable file",
            )
        })?;
        if read.is_empty() {
            return Ok(digest.finalize());
        }
        digest.update(read);
        let length = read.len();
        reader.consume(length);
    }
}

/// A name that may stand in a comment of any controller.
fn plain(text: &str) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || " .-_".contains(c);
    text.chars()
        .map(|c| if allowed(c) { c } else { '-' })
        .take(40)
        .collect()
}

fn name_of(path: &Path) -> String {
    plain(
        &path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy(),
    )
}
