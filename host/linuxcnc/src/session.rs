//! A LinuxCNC that is running, driven through its Python module.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Runs beside LinuxCNC; when the input of the script ends, it stops the machine and puts back what it changed.
const SCRIPT: &str = include_str!("session.py");

const PYTHON: &str = "python3";

/// Looks at the state, [`BETWEEN`] apart, until corrections must have faded.
const FADING: usize = 200;
const BETWEEN: Duration = Duration::from_millis(50);

/// Positions (mm, deg) by axis letter.
pub type AxisPositions = BTreeMap<char, f64>;

/// Why LinuxCNC did not do what was asked.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, thiserror::Error)]
#[error("{error}")]
pub struct SessionError {
    /// What happened.
    pub error: String,
    /// What to do about it.
    pub remedy: String,
}

/// What LinuxCNC is doing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct LinuxCncState {
    /// Path of the INI file that it was started with.
    pub ini: String,
    /// Local date and time, as a name for a folder.
    pub date: String,
    /// Out of emergency stop, and switched on.
    pub is_on: bool,
    /// All joints are homed.
    pub homed: bool,
}

/// The end of a touch.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TouchEnd {
    /// There was contact.
    pub tripped: bool,
    /// Where (machine position).
    pub position: AxisPositions,
    /// When (s since 1970).
    pub time: f64,
}

/// A session; its end stops the machine and puts back modes and pins.
#[derive(Debug)]
pub struct LinuxCncSession {
    script: Arc<Script>,
    from: BufReader<ChildStdout>,
}

/// The script that drives LinuxCNC.
#[derive(Debug)]
struct Script {
    child: Mutex<Child>,
    /// Input, until it is to end.
    to: Mutex<Option<ChildStdin>>,
    /// A [`Stopper`] ends it, and the program.
    is_stopping: AtomicBool,
}

/// Ends a session from another thread.
#[derive(Clone, Debug)]
pub struct Stopper(Arc<Script>);

impl Script {
    /// The end of its input: the script stops the machine and puts back what it changed. Waits until it has.
    fn end(&self) {
        *held(&self.to) = None;
        let _ = held(&self.child).wait();
    }
}

impl Stopper {
    /// Stops the machine and puts back what the session changed; returns when that is done. The thread of the session
    /// waits for ever in its next command, so the program must end.
    pub fn stop(&self) {
        self.0.is_stopping.store(true, Ordering::SeqCst);
        self.0.end();
    }
}

/// A thread that panics leaves nothing half done here.
fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Deserialize)]
struct SessionPins {
    pins: BTreeMap<String, Value>,
}

#[derive(Deserialize)]
struct Switched {
    changed: Option<String>,
}

impl LinuxCncSession {
    /// Connects to the LinuxCNC that is running on this computer.
    ///
    /// # Errors
    /// There is no Python, no LinuxCNC, or it is not running.
    pub fn start() -> Result<(Self, LinuxCncState), SessionError> {
        let mut script = Command::new(PYTHON)
            .args(["-u", "-c", SCRIPT])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| SessionError {
                error: format!("{PYTHON}: {error}"),
                remedy: "install Python 3, and LinuxCNC's module for it".to_owned(),
            })?;
        let (to, from) = (script.stdin.take(), script.stdout.take());
        let Some(from) = from else {
            return Err(ended());
        };
        let mut session = Self {
            script: Arc::new(Script {
                child: Mutex::new(script),
                to: Mutex::new(to),
                is_stopping: AtomicBool::new(false),
            }),
            from: BufReader::new(from),
        };
        let state = session.answer()?;
        Ok((session, state))
    }

    fn ask<A: DeserializeOwned>(&mut self, command: &Value) -> Result<A, SessionError> {
        let mut to = held(&self.script.to);
        let sent = to.as_mut().map(|to| {
            to.write_all(format!("{command}\n").as_bytes())
                .and_then(|()| to.flush())
        });
        drop(to);
        match sent {
            Some(Ok(())) => self.answer(),
            _ => Err(self.ended()),
        }
    }

    /// Asks for what has no answer but that it is done.
    fn tell(&mut self, command: &Value) -> Result<(), SessionError> {
        self.ask::<BTreeMap<String, Value>>(command).map(drop)
    }

    /// Ends this session from another thread.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(Arc::clone(&self.script))
    }

    /// Why there is no answer. If a [`Stopper`] has ended the script, the program is about to end.
    fn ended(&self) -> SessionError {
        while self.script.is_stopping.load(Ordering::SeqCst) {
            thread::park();
        }
        ended()
    }

    fn answer<A: DeserializeOwned>(&mut self) -> Result<A, SessionError> {
        let mut line = String::new();
        match self.from.read_line(&mut line) {
            Ok(read) if read > 0 => {}
            _ => return Err(self.ended()),
        }
        if let Ok(refused) = serde_json::from_str::<SessionError>(&line) {
            return Err(refused);
        }
        serde_json::from_str(&line).map_err(|error| SessionError {
            error: format!(
                "LinuxCNC's Python module answers `{}`: {error}",
                line.trim()
            ),
            remedy: "please report this".to_owned(),
        })
    }

    /// What LinuxCNC is doing.
    ///
    /// # Errors
    /// It does not answer, as for all commands.
    pub fn state(&mut self) -> Result<LinuxCncState, SessionError> {
        self.ask(&json!({"do": "state"}))
    }

    /// Homes all joints, which may take `seconds`.
    ///
    /// # Errors
    /// The machine is off or does not home.
    pub fn home(&mut self, seconds: f64) -> Result<LinuxCncState, SessionError> {
        self.ask(&json!({"do": "home", "seconds": seconds}))
    }

    /// Takes the machine over: MDI, mm, absolute, no offsets for radius or cycles.
    ///
    /// # Errors
    /// The machine is off, not homed, or runs a program.
    pub fn begin(&mut self) -> Result<LinuxCncState, SessionError> {
        self.ask(&json!({"do": "begin"}))
    }

    /// What [`joints`](Self::joints) would switch the kinematics by, if it has to.
    ///
    /// # Errors
    /// They cannot be switched.
    pub fn joints_by(&mut self) -> Result<Option<String>, SessionError> {
        let switched: Switched = self.ask(&json!({"do": "joints", "look": true}))?;
        Ok(switched.changed)
    }

    /// Switches to kinematics in which each axis is a joint, until the end of the session; returns what did it, if
    /// anything had to.
    ///
    /// # Errors
    /// They cannot be switched.
    pub fn joints(&mut self) -> Result<Option<String>, SessionError> {
        let switched: Switched = self.ask(&json!({"do": "joints"}))?;
        Ok(switched.changed)
    }

    /// Runs a line of G-code.
    ///
    /// # Errors
    /// LinuxCNC refuses or aborts it.
    pub fn run(&mut self, line: &str) -> Result<(), SessionError> {
        self.tell(&json!({"do": "run", "line": line}))
    }

    /// Moves axes to machine positions, as a rapid without a feed (mm/min). The probe must have no contact.
    ///
    /// # Errors
    /// The move did not reach its end.
    pub fn move_to(
        &mut self,
        target: &AxisPositions,
        feed: Option<f64>,
    ) -> Result<(), SessionError> {
        self.tell(&json!({"do": "move", "target": target, "feed": feed}))
    }

    /// Moves back from a contact, where the probe may still be tripped.
    ///
    /// # Errors
    /// The move did not reach its end.
    pub fn retreat(&mut self, target: &AxisPositions, feed: f64) -> Result<(), SessionError> {
        let command = json!({"do": "move", "target": target, "feed": feed, "clear": false});
        self.tell(&command)
    }

    /// Moves towards a machine position until there is contact (`G38.3`).
    ///
    /// # Errors
    /// There was contact before, or the touch was interrupted.
    pub fn touch(&mut self, target: &AxisPositions, feed: f64) -> Result<TouchEnd, SessionError> {
        self.ask(&json!({"do": "touch", "target": target, "feed": feed}))
    }

    /// Numbers on pins of HAL (1 for true); `None` for a pin that is not there or has no value.
    ///
    /// # Errors
    /// LinuxCNC does not answer.
    pub fn pins(&mut self, names: &[&str]) -> Result<Vec<Option<f64>>, SessionError> {
        let pins: SessionPins = self.ask(&json!({"do": "pins", "names": names}))?;
        let number = |value: &Value| value.as_f64().or(value.as_bool().map(f64::from));
        Ok(names
            .iter()
            .map(|name| pins.pins.get(*name).and_then(number))
            .collect())
    }

    /// Sets a pin that no signal drives, until the session ends, or for good after [`keep`](Self::keep).
    ///
    /// # Errors
    /// There is no such pin, or it is connected.
    pub fn set(&mut self, pin: &str, value: f64) -> Result<(), SessionError> {
        self.tell(&json!({"do": "set_pins", "pins": {pin: value}, "back": true}))
    }

    /// Switches the corrections of a component on or off, and waits until they have faded in or out.
    ///
    /// # Errors
    /// They do not.
    pub fn switch(&mut self, component: &str, on: bool) -> Result<(), SessionError> {
        let pin = |pin: &str| format!("{component}.{pin}");
        let factor = f64::from(on);
        self.set(&pin("enable"), factor)?;
        for _ in 0..FADING {
            let found = self.pins(&[&pin("factor"), &pin("fault-code")])?;
            if found[0] == Some(factor) {
                return Ok(());
            }
            if let (true, Some(code)) = (on, found[1].filter(|code| *code != 0.0)) {
                return Err(SessionError {
                    error: format!("the component has fault {code}"),
                    remedy: "`man trueaxis` explains the number".to_owned(),
                });
            }
            thread::sleep(BETWEEN);
        }
        Err(SessionError {
            error: format!("the corrections do not fade to {factor}"),
            remedy: format!("look at the pins of the component: halcmd show pin {component}"),
        })
    }

    /// Puts the compensation of `file` in the place of the one at `path`, which `component` reads, with corrections
    /// off; at the end the old one returns, unless [`keep`](Self::keep) says otherwise.
    ///
    /// # Errors
    /// The component does not take it, or its pins are driven by something else.
    pub fn load(&mut self, component: &str, path: &Path, file: &Path) -> Result<(), SessionError> {
        let file = file.canonicalize().unwrap_or(file.to_owned());
        self.tell(&json!({"do": "load", "component": component, "path": path, "file": file}))
    }

    /// Puts back pins and files as they were before the first change, as the end of the session would.
    ///
    /// # Errors
    /// The component does not take its file.
    pub fn undo(&mut self) -> Result<(), SessionError> {
        self.tell(&json!({"do": "undo"}))
    }

    /// Pins and files stay as they were set.
    ///
    /// # Errors
    /// LinuxCNC does not answer.
    pub fn keep(&mut self) -> Result<(), SessionError> {
        self.tell(&json!({"do": "keep"}))
    }
}

impl Drop for LinuxCncSession {
    fn drop(&mut self) {
        self.script.end();
    }
}

fn ended() -> SessionError {
    SessionError {
        error: "the connection to LinuxCNC has ended".to_owned(),
        remedy: "look at its screen and at the messages above".to_owned(),
    }
}
