//! LinuxCNC with the component, isolated from any other on this computer: with its own modules, shared memory,
//! processes and `/tmp`.

use lab_capi::{BuildCapacities, install};
use programs::process::{self, is_root, output, root, run, target, works};
use programs::{files, packages, trueaxis};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Where LinuxCNC looks for components.
const MODULES: &str = "/usr/lib/linuxcnc/modules";
/// Seconds after which a run counts as hung.
const LONGEST: &str = "900";
/// The command inside: `sh -c INSIDE sh BUILT MODULES WORK PROGRAM…`. The work folder is `/tmp` there, accessible to
/// any user, because LinuxCNC's real-time process drops root.
const INSIDE: &str =
    "mount --bind \"$1\" \"$2\" && mount --bind \"$3\" /tmp && cd /tmp && shift 3 && exec \"$@\"";

/// Environment of the tests.
pub struct LinuxCncBench {
    /// `/tmp` of the runs.
    work: PathBuf,
    modules: PathBuf,
    trueaxis: PathBuf,
}

/// Installs LinuxCNC if it is missing.
///
/// # Errors
/// If that fails.
pub fn provide_linuxcnc() -> Result<(), String> {
    if works(Command::new("halcompile").arg("--help")) {
        return Ok(());
    }
    packages::install(
        &["linuxcnc-uspace", "linuxcnc-uspace-dev"],
        "the LinuxCNC component",
    )
}

impl LinuxCncBench {
    /// # Errors
    /// If something cannot be installed or built.
    pub fn provide() -> Result<Self, String> {
        provide_linuxcnc()?;
        let folder = target("linuxcnc");
        let prefix = folder.join("prefix");
        install::below(&prefix, &BuildCapacities::USUAL)?;
        let bench = Self {
            work: folder.join("tmp"),
            modules: folder.join("modules"),
            trueaxis: trueaxis::build()?,
        };
        let _ = fs::remove_dir_all(&bench.work);
        for folder in [&bench.work, &bench.modules] {
            files::folder(folder.clone())?;
        }
        run(Command::new("chmod").arg("1777").arg(&bench.work))?;
        run(Command::new("cp")
            .args(["-r", "-T", MODULES])
            .arg(&bench.modules))?;
        let build = files::folder(folder.join("build"))?;
        for (folder, built) in [
            ("firmware/linuxcnc", &["trueaxis.so"][..]),
            ("firmware/linuxcnc/model", &["trueaxis_model.so"]),
            (
                "firmware/linuxcnc/tests",
                &["tape.so", "rivals.so", "rivals_fast.so"],
            ),
        ] {
            run(Command::new("make")
                .args(["-s", "-f"])
                .arg(root().join(folder).join("Makefile"))
                .arg(format!("TRUEAXIS={}", prefix.display()))
                .current_dir(&build))?;
            for name in built {
                files::copy(&build.join(name), &bench.modules.join(name))?;
            }
        }
        bench.copy("firmware/linuxcnc/tests/until", "until")?;
        Ok(bench)
    }

    /// With a `/tmp` of its own, to run beside this one.
    pub fn apart(&self, name: &str) -> Result<Self, String> {
        let work = target("linuxcnc").join(name);
        let _ = fs::remove_dir_all(&work);
        files::folder(work.clone())?;
        run(Command::new("chmod").arg("1777").arg(&work))?;
        Ok(Self {
            work,
            modules: self.modules.clone(),
            trueaxis: self.trueaxis.clone(),
        })
    }

    /// Runs `f` with another component in place of the built one.
    pub fn with_module<T>(
        &self,
        module: &Path,
        doing: impl FnOnce() -> Result<T, String>,
    ) -> Result<T, String> {
        let place = self.modules.join("trueaxis.so");
        let kept = files::read(&place)?;
        files::copy(module, &place)?;
        let done = doing();
        files::write(&place, kept)?;
        done
    }

    /// The command `trueaxis`.
    pub fn trueaxis_path(&self) -> &Path {
        &self.trueaxis
    }

    /// LinuxCNC's real-time modules, with the component.
    pub fn modules(&self) -> &Path {
        &self.modules
    }

    /// A file that the runs see as `/tmp/NAME`.
    pub fn file(&self, name: &str) -> PathBuf {
        self.work.join(name)
    }

    /// Writes such a file.
    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> Result<(), String> {
        files::write(&self.file(name), contents)
    }

    /// Copies a file there.
    pub fn copy(&self, from: &str, name: &str) -> Result<(), String> {
        files::copy(&root().join(from), &self.file(name))
    }

    /// Copies the configurations of simulated machines to `configs`.
    pub fn configurations(&self) -> Result<(), String> {
        self.copy_folder("firmware/linuxcnc/configs", "configs")
    }

    /// Copies a folder there.
    pub fn copy_folder(&self, from: &str, name: &str) -> Result<(), String> {
        run(Command::new("cp")
            .args(["-r", "-T"])
            .arg(root().join(from))
            .arg(self.file(name)))
    }

    /// Lets any user write into a folder.
    pub fn open_to_all(&self, folder: &str) -> Result<(), String> {
        run(Command::new("chmod")
            .args(["-R", "a+rwX"])
            .arg(self.file(folder)))
    }

    /// Compiles tables with a thousand random positions.
    pub fn compile(
        &self,
        machine: &str,
        errors: &str,
        trax: &str,
        options: &[&str],
    ) -> Result<(), String> {
        let words = ["compile", machine, errors, "-o", trax, "--random", "1000"];
        self.trueaxis(&[&words, options].concat()).map(drop)
    }

    /// Writes the model of a simulated machine.
    pub fn model(&self, machine: &str, errors: &str, model: &str) -> Result<(), String> {
        self.trueaxis(&["linuxcnc", "model", machine, errors, "-o", model])
            .map(drop)
    }

    /// The command `trueaxis`, as the runs see it.
    pub fn program(&self) -> Result<&'static str, String> {
        files::copy(&self.trueaxis, &self.file("trueaxis"))?;
        run(Command::new("chmod").arg("a+rx").arg(self.file("trueaxis")))?;
        Ok("/tmp/trueaxis")
    }

    /// Output of the command `trueaxis`.
    pub fn trueaxis(&self, words: &[&str]) -> Result<String, String> {
        let mut command = Command::new(&self.trueaxis);
        command.args(words).current_dir(&self.work);
        output(&mut command)
    }

    /// What the command prints, whatever its exit code is.
    pub fn trueaxis_said(&self, words: &[&str]) -> Result<String, String> {
        let mut command = Command::new(&self.trueaxis);
        command.args(words).current_dir(&self.work);
        Ok(process::said(&mut command)?.output)
    }

    /// Runs a program of LinuxCNC; returns the output of all its parts.
    pub fn inside(&self, program: &[&str]) -> Result<String, String> {
        let mut command = Command::new("timeout");
        command.args(["-k", "5", LONGEST]);
        if !is_root() {
            // Separate namespaces, for which some systems require root.
            command.args(["sudo", "-n", "-E"]);
        }
        command
            .args(["unshare", "--mount", "--ipc", "--net", "--pid", "--fork"])
            .args(["--kill-child", "--mount-proc", "sh", "-c", INSIDE, "sh"])
            .arg(&self.modules)
            .arg(MODULES)
            .arg(&self.work)
            .args(program)
            .env("HOME", "/tmp")
            .env("RTAPI_UID", "65534")
            .env("RTAPI_FIFO_PATH", "/tmp/.fifo");
        let log = self.file("log");
        let to = fs::File::create(&log).map_err(|e| format!("{}: {e}", log.display()))?;
        let errors = to.try_clone().map_err(|e| e.to_string())?;
        let status = command
            .stdin(Stdio::null())
            .stdout(to)
            .stderr(errors)
            .status()
            .map_err(|e| format!("`timeout` does not start: {e}"))?;
        let said = String::from_utf8_lossy(&files::read(&log)?).into_owned();
        // Terminated, or killed after five more seconds.
        if matches!(status.code(), Some(124 | 137) | None) {
            return Err(format!("hangs after {LONGEST} s:\n{said}"));
        }
        Ok(said)
    }

    /// Runs lines of HAL; returns the output.
    pub fn halrun(&self, lines: &str) -> Result<String, String> {
        self.write("test.hal", lines)?;
        self.inside(&["halrun", "-f", "/tmp/test.hal"])
    }
}

/// An INI file without the lines that need a screen.
pub fn without_panels(ini: &str) -> String {
    let needs_screen = |line: &&str| line.starts_with("PYVCP") || line.starts_with("POSTGUI");
    let lines = ini.lines().filter(|line| !needs_screen(line));
    lines.map(|line| format!("{line}\n")).collect()
}
