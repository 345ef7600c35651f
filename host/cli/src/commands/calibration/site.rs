//! A machine, with what moves it and what corrects it.

use crate::commands::bad_input::BadInput;
use crate::commands::files::Text;
use crate::commands::output;
use crate::commands::port::PortArguments;
use crate::commands::probing::{CLEAR, SpeedOptions, Work, asked, bad, take_over};
use crate::commands::touch_options::TouchOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_link::{BoardError, BoardOnTrial, Port};
use trueaxis_linuxcnc::LinuxCncSession;
use trueaxis_model::machine::Machine;
use trueaxis_probing::plan::{self, Feeds, Setup, collision, steps};
use trueaxis_probing::spheres::read_log;

/// What moves the machine and probes.
pub enum Moves<'a> {
    /// LinuxCNC, move by move.
    LinuxCnc {
        session: LinuxCncSession,
        speeds: &'a SpeedOptions,
    },
    /// The machine's own controller, whose logs arrive as files.
    ByItself,
}

impl Moves<'_> {
    fn session(&mut self) -> Result<&mut LinuxCncSession, BadInput> {
        match self {
            Self::LinuxCnc { session, .. } => Ok(session),
            Self::ByItself => Err(BadInput::new(
                "the component needs LinuxCNC",
                "give --port for a board",
            )),
        }
    }
}

/// What corrects the machine.
pub enum Corrects {
    /// The component in LinuxCNC that reads this file.
    Component { name: &'static str, path: PathBuf },
    /// A board.
    Board(Box<OnBoard>),
}

/// A board, and what puts back its state if this program ends before it could.
pub struct OnBoard {
    board: BoardOnTrial<Box<dyn Port + Send>>,
    port: PortArguments,
    guard: Option<Child>,
}

impl Corrects {
    /// The board at a port.
    pub fn board(port: &str) -> Result<Self, BadInput> {
        let port = PortArguments {
            port: port.to_owned(),
            baud: PortArguments::BAUD,
        };
        let (client, _) = port.connect()?;
        let board = BoardOnTrial::new(client).map_err(|error| bad_board(&port, error))?;
        Ok(Self::Board(Box::new(OnBoard {
            board,
            port,
            guard: None,
        })))
    }
}

fn bad_board(port: &PortArguments, error: BoardError) -> BadInput {
    match error {
        BoardError::Flash(error) => port.bad_flash(&error),
        BoardError::Link(error) => port.bad(&error),
        other => BadInput::new(
            format!("{}: {other}", port.port),
            "`trueaxis monitor` shows the reason: axes that are not referenced, positions that do not arrive",
        ),
    }
}

impl OnBoard {
    /// Starts a shell that waits for the end of this program, and then puts back what the board did before. It is in a
    /// group of its own, so that Ctrl-C does not end it.
    fn guard(&mut self) -> Result<(), BadInput> {
        if self.guard.is_some() {
            return Ok(());
        }
        let no_guard = |error: std::io::Error| {
            BadInput::new(
                format!("a shell cannot be started that puts the board back after Ctrl-C: {error}"),
                "look whether `sh` is in the path",
            )
        };
        let program = std::env::current_exe().map_err(no_guard)?;
        // A board that is busy with a change refuses for a moment. It is not switched on with anything else.
        let mut script = "read -r _ && exit 0\nn=0\n".to_owned();
        for action in self.board.back() {
            script += &format!(
                "until \"$0\" control --port \"$1\" {action}; do n=$((n + 1)); [ $n -lt 10 ] || exit 1; sleep 1; done\n"
            );
        }
        let mut command = Command::new("sh");
        command
            .args(["-c", &script])
            .arg(program)
            .arg(&self.port.port);
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let started = command.stdin(Stdio::piped()).stdout(Stdio::null()).spawn();
        self.guard = Some(started.map_err(no_guard)?);
        Ok(())
    }

    /// Changes what the board does, which is put back however this program ends.
    fn guarded(
        &mut self,
        change: impl FnOnce(&mut BoardOnTrial<Box<dyn Port + Send>>) -> Result<(), BoardError>,
    ) -> Result<(), BadInput> {
        self.guard()?;
        change(&mut self.board).map_err(|error| bad_board(&self.port, error))
    }

    fn undo(&mut self) -> Result<(), BadInput> {
        self.board
            .undo()
            .map_err(|error| bad_board(&self.port, error))?;
        self.release();
        Ok(())
    }

    /// Everything is as it should be.
    fn release(&mut self) {
        if let Some(mut guard) = self.guard.take() {
            if let Some(mut to) = guard.stdin.take() {
                let _ = to.write_all(b"\n");
            }
            let _ = guard.wait();
        }
    }
}

/// Rows of a plan to be probed into a log.
pub struct Errand<'a> {
    pub machine: &'a Machine,
    pub artefact: &'a Artefact,
    pub plan: Probings,
    pub touching: TouchOptions,
    /// The plan's file.
    pub file: PathBuf,
    pub log: PathBuf,
}

/// A machine.
pub struct Site<'a> {
    moves: Moves<'a>,
    corrects: Corrects,
}

/// Time of a rapid move (s) in the forecast.
const RAPID: f64 = 4.0;
/// Between two looks at a file.
const LOOK: Duration = Duration::from_millis(300);
/// Feed rates of programs (mm/min), as of `trueaxis plan`.
const FEEDS: Feeds = Feeds {
    touch: 60.0,
    near: 1000.0,
};

impl<'a> Site<'a> {
    pub fn new(moves: Moves<'a>, corrects: Corrects) -> Self {
        Self { moves, corrects }
    }

    /// The file of the compensation that is in use, if it is on this computer.
    pub fn file(&self) -> Option<&Path> {
        match &self.corrects {
            Corrects::Component { path, .. } => Some(path),
            Corrects::Board(_) => None,
        }
    }

    /// What a compensation must fit, as `compile --target` takes it: a name, or a file that this writes.
    pub fn target(&self, file: &Path) -> Result<String, BadInput> {
        match &self.corrects {
            Corrects::Component { .. } => Ok("desktop".to_owned()),
            Corrects::Board(on) => {
                output::write(file, on.board.target().to_toml().as_bytes())?;
                Ok(file.display().to_string())
            }
        }
    }

    /// Where the compensation is.
    pub fn place(&self) -> String {
        match &self.corrects {
            Corrects::Component { path, .. } => path.display().to_string(),
            Corrects::Board(on) => format!("{}: the compensation", on.port.port),
        }
    }

    /// Says what will be probed, and gets the machine ready; false if the operator does not want it.
    pub fn is_ready(&mut self, errands: &[&Errand<'_>], yes: bool) -> Result<bool, BadInput> {
        match &self.moves {
            Moves::LinuxCnc { speeds, .. } => {
                let mut text = "\n".to_owned();
                let mut seconds = 0.0;
                for errand in errands {
                    let work = errand.work(speeds)?;
                    text += &format!("{}: {}", errand.log.display(), work.announced());
                    seconds += work.seconds(RAPID);
                }
                text += &format!(
                    "probing takes about {:.0} min at 100 % feed\n",
                    (seconds / 60.0).ceil()
                );
                output::print(&text)?;
                Ok((yes || asked(CLEAR)?) && self.take_over(yes)?)
            }
            Moves::ByItself => {
                for errand in errands {
                    errand.write()?;
                }
                Ok(true)
            }
        }
    }

    /// Takes over a machine that LinuxCNC moves; false if the operator does not want it.
    pub fn take_over(&mut self, yes: bool) -> Result<bool, BadInput> {
        match &mut self.moves {
            Moves::LinuxCnc { session, .. } => take_over(session, yes),
            Moves::ByItself => Ok(true),
        }
    }

    /// Probes, or waits until somebody has.
    pub fn touch(&mut self, errand: &Errand<'_>) -> Result<(), BadInput> {
        let touches = match &mut self.moves {
            Moves::LinuxCnc { session, speeds } => errand.work(speeds)?.probe(session)?,
            Moves::ByItself => {
                // A program that was written before names another log.
                errand.write()?;
                errand.wait()?
            }
        };
        output::print(&format!("{}: {touches} touches\n", errand.log.display()))
    }
}

impl Errand<'_> {
    fn work<'b>(&'b self, speeds: &'b SpeedOptions) -> Result<Work<'b>, BadInput> {
        Work::new(
            self.machine,
            self.artefact,
            self.plan.clone(),
            &self.touching,
            speeds,
            &self.log,
        )
    }

    fn setup(&self) -> Result<Setup<'_>, BadInput> {
        Ok(Setup {
            machine: self.machine,
            artefact: self.artefact,
            balls: self.plan.balls.clone(),
            probe: self.touching.stated()?,
            sigma: 1e-3,
            observations: None,
        })
    }

    /// A table and a program of the touches, beside the plan.
    fn write(&self) -> Result<(), BadInput> {
        use crate::commands::plan::{collides, not_reached};
        let setup = self.setup()?;
        let not_reached = |why: plan::NotTouched| not_reached(*why, &self.plan);
        let moves = steps(&setup, &self.plan).map_err(not_reached)?;
        if let Some(collision) = collision(&setup, &self.plan, &moves) {
            return Err(collides(&collision));
        }
        let name = self.log.file_name().map(|name| name.to_string_lossy());
        let name = name.unwrap_or_default();
        let program = plan::linuxcnc(&setup, &self.plan, FEEDS, &name).map_err(not_reached)?;
        let table = plan::table(&setup, &self.plan).map_err(not_reached)?;
        output::write(&self.file.with_extension("touches.csv"), table.as_bytes())?;
        output::write(&self.file.with_extension("ngc"), program.as_bytes())
    }

    /// Waits until the log has all touches; returns their number.
    fn wait(&self) -> Result<usize, BadInput> {
        let wanted = self.plan.rows.len() * self.touching.stated()?.per_ball();
        output::print(&format!(
            "\nprobe {} (or {}), and write the {wanted} touches to {}\n",
            self.file.with_extension("ngc").display(),
            self.file.with_extension("touches.csv").display(),
            self.log.display()
        ))?;
        loop {
            if self.log.exists() {
                let text = Text::read(&self.log)?;
                // A line that is being written may be no touch yet.
                let whole = text.text.rfind('\n').map_or("", |end| &text.text[..=end]);
                match read_log(whole, self.machine) {
                    Ok(touches) if touches.len() >= wanted => return Ok(touches.len()),
                    Err(error) if whole.lines().count() > 1 => return Err(text.bad(error)),
                    _ => {}
                }
            }
            sleep(LOOK);
        }
    }
}

impl Site<'_> {
    /// Switches the corrections on or off, and waits until they have faded in or out.
    pub fn switch(&mut self, on: bool) -> Result<(), BadInput> {
        match &mut self.corrects {
            Corrects::Component { name, .. } => self.moves.session()?.switch(name, on).map_err(bad),
            Corrects::Board(on_board) => on_board.guarded(|board| board.switch(on)),
        }
    }

    /// Puts the compensation of a file in the place of the one in use, with the corrections off.
    pub fn load(&mut self, blob: &Path) -> Result<(), BadInput> {
        match &mut self.corrects {
            Corrects::Component { name, path } => {
                self.moves.session()?.load(name, path, blob).map_err(bad)
            }
            Corrects::Board(on_board) => on_board.guarded(|board| board.load(blob)),
        }
    }

    /// What has been loaded and switched stays.
    pub fn keep(&mut self) -> Result<(), BadInput> {
        match &mut self.corrects {
            Corrects::Component { .. } => self.moves.session()?.keep().map_err(bad),
            Corrects::Board(on_board) => {
                on_board.board.keep();
                on_board.release();
                Ok(())
            }
        }
    }

    /// Puts back what was there before the first change.
    pub fn undo(&mut self) -> Result<(), BadInput> {
        match &mut self.corrects {
            Corrects::Component { .. } => self.moves.session()?.undo().map_err(bad),
            Corrects::Board(on_board) => on_board.undo(),
        }
    }
}

impl Drop for Site<'_> {
    /// A board does again what it did before, unless the new compensation was kept. (The session does that for LinuxCNC.)
    fn drop(&mut self) {
        if let Corrects::Board(on_board) = &mut self.corrects {
            let _ = on_board.undo();
        }
    }
}
