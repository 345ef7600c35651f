#!/usr/bin/env python3
"""Runs `trueaxis linuxcnc start` on every sample configuration of LinuxCNC, and LinuxCNC with each that it accepts.

samples.py TRUEAXIS MODULES WORK all|few [PART]: the command, the folder of real-time modules with the component, a folder
for copies; all configurations or the first one of each folder; only those whose path contains PART. Prints one line per
configuration: started, refused with the first reason, or without hardware (LinuxCNC does not start without the component either). Exits with 1 if LinuxCNC starts
without the component, and not with it.
"""

import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import local

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs")
MODULES = "/usr/lib/linuxcnc/modules"
# Seconds after which a start counts as hung; a sample takes 5 to 15 on two idle cores.
LONGEST = 90
# Starts mostly wait.
WORKERS = 2 * (os.cpu_count() or 1)
# In place of the screen: LinuxCNC runs it when HAL is complete, and ends after it.
DISPLAY = "#!/bin/sh\nhalcmd show pin trueaxis.enable >/tmp/started 2>&1\n"
# In place of the window that shows LinuxCNC's log if it fails.
ERRORS = "/usr/lib/tcltk/linuxcnc/show_errors.tcl"
LOGS = "file copy -force [lindex $argv 0] /tmp/debug\nfile copy -force [lindex $argv 1] /tmp/print\nexit\n"
# LinuxCNC under a screen that nobody sees, for programs like hal_manualtoolchange.
INSIDE = (
    'mount --bind "$1" ' + MODULES + ' && mount --bind "$2/logs.tcl" ' + ERRORS + " || exit 1\n"
    'mount --bind "$2" /tmp && cd "$3" || exit 1\n'
    "Xvfb :9 -screen 0 1024x768x24 -nolisten tcp >/dev/null 2>&1 &\n"
    "export DISPLAY=:9 HOME=/tmp RTAPI_UID=65534 RTAPI_FIFO_PATH=/tmp/.fifo\n"
    "for i in $(seq 50); do [ -S /tmp/.X11-unix/X9 ] && break; sleep 0.1; done\n"
    'linuxcnc "$4"\n'
)
thread = local()


def own_folder(work):
    """A copy of all samples for this thread, accessible to any user: real-time processes drop root."""
    if not hasattr(thread, "folder"):
        thread.folder = work / f"thread-{os.getpid()}-{id(thread.__dict__)}"
        thread.folder.mkdir(parents=True)
        thread.folder.chmod(0o1777)
        copy(SAMPLES, thread.folder / "configs")
    return thread.folder


def copy(of, to):
    """Copies a folder; the package has links that lead nowhere."""
    shutil.copytree(of, to, ignore_dangling_symlinks=True)
    subprocess.run(["chmod", "-R", "a+rwX", str(to)], check=True)


def runs(folder, modules, ini):
    """Whether LinuxCNC comes up to its screen with this INI file, and what it says."""
    display = folder / "display"
    display.write_text(DISPLAY)
    display.chmod(0o755)
    (folder / "logs.tcl").write_text(LOGS)
    for file in [ini, *ini.parent.rglob("*.inc")]:
        text = file.read_text(errors="surrogateescape")
        text = re.sub(r"(?m)^(\s*DISPLAY\s*=).*", r"\1 /tmp/display", text)
        text = re.sub(r"(?m)^\s*(POSTGUI_HAL\w*|APP|INTRO_GRAPHIC)\s*=.*", "", text)
        file.write_text(text, errors="surrogateescape")
    # Left by the screen of the run before.
    (folder / ".X9-lock").unlink(missing_ok=True)
    shutil.rmtree(folder / ".X11-unix", ignore_errors=True)
    started = folder / "started"
    started.unlink(missing_ok=True)
    inside = Path("/tmp") / ini.relative_to(folder)
    command = ["timeout", "-k", "5", str(LONGEST), "unshare", "--mount", "--ipc", "--net", "--pid", "--fork"]
    command += ["--kill-child", "--mount-proc", "sh", "-c", INSIDE, "sh", str(modules), str(folder)]
    command += [str(inside.parent), inside.name]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said = done.stdout.decode(errors="replace")
    for name in ("print", "debug"):
        file = folder / name
        if file.exists():
            said += file.read_text(errors="replace")
            file.unlink()
    return started.exists(), said, started.read_text() if started.exists() else ""


def start(trueaxis, ini):
    """Exit code of `start`, and what it says."""
    words = [trueaxis, "linuxcnc", "start", str(ini), "--yes", "--install", "--overwrite"]
    # With a reading along X, unless the INI file compensates X.
    for reading in (["--scale", "X=2/100"], []):
        done = subprocess.run(words + reading, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        said = done.stdout + done.stderr
        if "the INI file already compensates X" not in said:
            break
    return done.returncode, said


def reason(said):
    """The first reason of a refusal, without its place."""
    lines = said.replace("\n  │ ", " ").splitlines()
    for line in lines:
        if line.startswith("refused: "):
            return re.sub(r"^refused: .*?, line \d+: ", "", line)
    return next((line.strip() for line in lines if line.strip()), "nothing said")


def sample(trueaxis, modules, work, name):
    folder = own_folder(work)
    ini = folder / "configs" / name
    try:
        return tried(trueaxis, modules, folder, ini)
    finally:
        # As it was, for other samples of the same folder.
        shutil.rmtree(ini.parent)
        copy(SAMPLES / Path(name).parent, ini.parent)


def tried(trueaxis, modules, folder, ini):
    original = ini.read_bytes()
    code, said = start(trueaxis, ini)
    if code and "_cmds.hal" in said:
        # The remedy: start LinuxCNC once, so that basic_sim.tcl leaves its commands.
        runs(folder, modules, ini)
        ini.write_bytes(original)
        code, said = start(trueaxis, ini)
    if code:
        changed = ini.read_bytes() != original or "trueaxis.hal" in os.listdir(ini.parent)
        return ("FAILED" if changed or code not in (1, 2) else "refused"), reason(said)
    # On a busy computer a program that HAL waits for may come up too late: once more then.
    for _ in range(2):
        is_up, said, pins = runs(folder, modules, ini)
        if is_up:
            break
    if is_up:
        return ("started", "") if "trueaxis.enable" in pins else ("FAILED", "without the component: " + pins)
    ini.write_bytes(original)
    for made in ("trueaxis.hal", "machine.trax"):
        (ini.parent / made).unlink(missing_ok=True)
    without, _, _ = runs(folder, modules, ini)
    if not without:
        return "without hardware", "LinuxCNC does not start without the component either"
    return "FAILED", said[-1500:]


def main():
    trueaxis, modules, work, which = sys.argv[1:5]
    part = sys.argv[5] if len(sys.argv) > 5 else ""
    work = Path(work)
    shutil.rmtree(work, ignore_errors=True)
    names = sorted(str(ini.relative_to(SAMPLES)) for ini in SAMPLES.rglob("*.ini"))
    if which == "few":
        folders = {os.path.dirname(name): name for name in reversed(names)}
        names = sorted(folders.values())
    names = [name for name in names if part in name]
    counts = {}
    with ThreadPoolExecutor(WORKERS) as pool:
        results = pool.map(lambda name: sample(trueaxis, modules, work, name), names)
        for name, (state, why) in zip(names, results):
            counts[state] = counts.get(state, 0) + 1
            print(f"{state}: {name}" + (f": {why}" if why else ""), flush=True)
    print(", ".join(f"{count} {state}" for state, count in sorted(counts.items())))
    sys.exit(1 if counts.get("FAILED") or not counts.get("started") else 0)


if __name__ == "__main__":
    main()
