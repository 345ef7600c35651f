//! One emulated board: QEMU with a flash in a file.

use crate::Failure;
use crate::cases::Compiled;
use serde_json::Value;
use std::fs::{self, File};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use trueaxis_link::{Client, LinkedController, Tcp};

/// Locations of programs and output files.
pub struct Setup<'c> {
    /// The QEMU board that runs it.
    pub machine: String,
    /// The firmware for QEMU.
    pub firmware: PathBuf,
    /// The command `trueaxis`.
    pub command: PathBuf,
    /// For flash contents and logs.
    pub folder: PathBuf,
    /// The compensations to flash.
    pub compiled: &'c Compiled,
}

impl Setup<'_> {
    /// Runs `trueaxis WORDS`. QEMU does not listen for a moment after a connection has ended: a command that finds nobody
    /// is run again.
    pub fn trueaxis(&self, words: &[&str]) -> Result<Output, Failure> {
        let end = Instant::now() + Duration::from_secs(5);
        loop {
            let output = Command::new(&self.command).args(words).output()?;
            let is_refused = String::from_utf8_lossy(&output.stderr).contains("Connection refused");
            if !is_refused || Instant::now() > end {
                return Ok(output);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Runs `trueaxis WORDS`, which must succeed.
    pub fn succeed(&self, words: &[&str]) -> Result<(), Failure> {
        self.answer(words).map(drop)
    }

    /// Like [`Self::succeed`]; returns the output.
    pub fn answer(&self, words: &[&str]) -> Result<String, Failure> {
        let output = self.trueaxis(words)?;
        if output.status.success() {
            return Ok(String::from_utf8(output.stdout)?);
        }
        let said = String::from_utf8_lossy(&output.stderr);
        Err(format!("trueaxis {}: {said}", words.join(" ")).into())
    }

    /// A new board called `name`, with blank flash; off.
    pub fn board(&self, name: &str) -> Result<Board<'_>, Failure> {
        let folder = self.folder.join(name);
        // Left by an earlier run.
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder)?;
        Ok(Board {
            setup: self,
            folder,
            running: None,
            port: 0,
        })
    }
}

/// A board that can be switched on and off.
pub struct Board<'s> {
    pub setup: &'s Setup<'s>,
    folder: PathBuf,
    running: Option<Child>,
    port: u16,
}

impl Board<'_> {
    /// Switches the power on.
    pub fn start(&mut self) -> Result<(), Failure> {
        self.start_wanting(None)
    }

    /// Starts the board again, optionally with a requested failure.
    pub fn start_wanting(&mut self, wanted: Option<&str>) -> Result<(), Failure> {
        self.stop();
        // This port was free a moment ago; QEMU cannot choose one itself.
        self.port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
        let log = |name: &str| {
            File::options()
                .create(true)
                .append(true)
                .open(self.folder.join(name))
        };
        let child = Command::new("qemu-system-arm")
            .current_dir(&self.folder)
            .args(["-machine", &self.setup.machine])
            .args(["-nographic", "-monitor", "none"])
            .arg("-semihosting-config")
            .arg(format!(
                "enable=on,target=native,arg=qemu{}",
                wanted.map_or_else(String::new, |word| format!(",arg={word}"))
            ))
            .arg("-serial")
            .arg(format!(
                "tcp:127.0.0.1:{},server=on,wait=off,nodelay=on",
                self.port
            ))
            .arg("-kernel")
            .arg(&self.setup.firmware)
            .stdin(Stdio::null())
            .stdout(log("log.defmt")?)
            .stderr(log("qemu.txt")?)
            .spawn()?;
        self.running = Some(child);
        // A connection without data does no harm, and is closed at once.
        self.dial(Duration::from_secs(20)).map(drop)
    }

    /// Cuts the power.
    pub fn stop(&mut self) {
        if let Some(mut child) = self.running.take() {
            // It may have ended already.
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    fn address(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// Port in the command's notation.
    pub fn port(&self) -> String {
        format!("tcp:{}", self.address())
    }

    /// A raw line to it, without the link protocol.
    pub fn line(&self) -> Result<Tcp, Failure> {
        self.dial(Duration::from_secs(5))
    }

    /// Connects as soon as QEMU listens.
    fn dial(&self, patience: Duration) -> Result<Tcp, Failure> {
        let end = Instant::now() + patience;
        loop {
            match Tcp::open(&self.address()) {
                Err(error) if Instant::now() > end => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
                Ok(line) => return Ok(line),
            }
        }
    }

    /// Opens the link.
    pub fn connect(&self) -> Result<(Client<Tcp>, LinkedController), Failure> {
        Ok(Client::connect(self.line()?)?)
    }

    /// Uploads with the real command. A machine that has just moved counts as standing still only after a while: until
    /// then the command is refused and repeated.
    pub fn flash(&self, blob: &Path, further: &[&str]) -> Result<(), Failure> {
        let mut words = vec!["flash", text(blob)?, "--port"];
        let port = self.port();
        words.push(&port);
        words.extend(further);
        for _ in 0..20 {
            match self.setup.succeed(&words) {
                Err(refused) if refused.to_string().contains("only at standstill") => {
                    std::thread::sleep(Duration::from_millis(250));
                }
                done => return done,
            }
        }
        self.setup.succeed(&words)
    }

    /// Runs `trueaxis control WORDS` with the real command; returns the status afterwards.
    pub fn control(&self, words: &[&str]) -> Result<Value, Failure> {
        let port = self.port();
        let first = ["control", "--port", &port, "--json"];
        let answer = self.setup.answer(&[&first[..], words].concat())?;
        let mut answer: Value = serde_json::from_str(&answer)?;
        Ok(answer["after"].take())
    }

    /// Starts an upload with the real command, without waiting for it to finish.
    pub fn begin_flash(&self, blob: &Path) -> Result<Child, Failure> {
        let child = Command::new(&self.setup.command)
            .arg("flash")
            .arg(blob)
            .args(["--activate", "--port", &self.port()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        Ok(child)
    }

    /// The file with the contents of its flash.
    pub fn flash_file(&self) -> PathBuf {
        self.folder.join("flash.bin")
    }
}

impl Drop for Board<'_> {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A path as an argument.
pub fn text(path: &Path) -> Result<&str, Failure> {
    Ok(path.to_str().ok_or("a path that is not a text")?)
}
