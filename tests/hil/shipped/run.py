"""The image of a release, run: `run.py IMAGE TRUEAXIS FOLDER`. `cargo xtask hil` calls it.

The chip is that of `stm32f405.py`, the other end of its line is the command `trueaxis`, and the motion side is here.
"""

import csv
import json
import math
import random
import socket
import struct
import subprocess
import sys
import zlib
from pathlib import Path

from stm32f405 import Chip, PowerCut, Wrong

EXAMPLES = Path(__file__).parents[3] / "examples"
AXES = 8
SLOT_B = 0x080C_0000


class Failed(Exception):
    """A promise that was not kept."""


def holds(condition, what):
    if not condition:
        raise Failed(what)


class Board:
    """A chip with a host and a motion side."""

    def __init__(self, image, trueaxis):
        self.chip = Chip(image)
        self.trueaxis = trueaxis
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.setblocking(False)
        self.port = f"tcp:127.0.0.1:{self.listener.getsockname()[1]}"
        self.line = None
        self.cuts = 0
        # The connection ends after so many bytes of the host.
        self.drops_after = None
        # Where the motion side stands; without one there are no frames.
        self.place = None
        self.count = 0
        self.settle()

    def settle(self):
        """Half a second, after which a machine at rest counts as standing still."""
        for _ in range(2000):
            self.period()

    def period(self):
        """One servo period, and what passes over the line in it; returns the answer of its frame."""
        chip, sent = self.chip, None
        if self.place is not None:
            self.count += 1
            sent = frame(self.count, self.place)
        if self.line is None:
            try:
                self.line, _ = self.listener.accept()
                self.line.setblocking(False)
            except BlockingIOError:
                pass
        else:
            try:
                got = self.line.recv(4096)
                if not got:
                    self.hang_up()
                chip.received += got
                if self.drops_after is not None:
                    self.drops_after -= len(got)
                    if self.drops_after <= 0:
                        self.drops_after = None
                        self.hang_up()
            except BlockingIOError:
                pass
            except ConnectionError:
                self.hang_up()
        try:
            answer = chip.period(sent)
        except PowerCut:
            chip.cut()
            self.cuts += 1
            answer = None
        if chip.sent:
            if self.line is not None:
                try:
                    self.line.sendall(chip.sent)
                except ConnectionError:
                    self.hang_up()
            chip.sent.clear()
        return answer

    def hang_up(self):
        if self.line is not None:
            self.line.close()
        self.line = None

    def says(self, *words, code=0):
        """Runs `trueaxis WORDS` with its port; returns what it prints."""
        command = [self.trueaxis, words[0], "--port", self.port, *words[1:]]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
            while run.poll() is None:
                self.period()
            said = run.stdout.read()
        self.hang_up()
        holds(code is None or run.returncode == code, f"{' '.join(map(str, words))}: {run.returncode}\n{said}")
        return said

    def state(self):
        return json.loads(self.says("monitor", "--json", "--count", "1"))

    def in_use(self):
        return self.state()["compensation"]


def frame(count, positions):
    """A frame of the motion side (docs/src/board.md)."""
    head = struct.pack("<BBHBBHf", 2, count & 0xFF, 0xFFFF, 0, AXES, 0, 0.0)
    body = head + struct.pack(f"<{AXES}f", *positions, *[0.0] * (AXES - len(positions)))
    return body + struct.pack("<I", zlib.crc32(body))


def answered(bytes_):
    """Count, whether there is no fault, conditions, and corrections of an answer."""
    holds(struct.unpack("<I", bytes_[-4:])[0] == zlib.crc32(bytes_[:-4]), "an answer with a wrong checksum")
    _, count, conditions, flags = struct.unpack_from("<BBHB", bytes_)
    return count, flags, conditions, bytes_[12:-4]


def used(board, blobs, folder):
    """Flashed, switched on, watched, and corrected by frames, with every digit of `eval`."""
    board.says("flash", blobs[0], "--activate")
    axes = "YACXZ"
    path = folder / "path.csv"
    # All axes move one way and slowly, so that no limit acts.
    steps = (2e-3, 7e-4, 3e-3, -1e-3, 3e-3)
    rows = [struct.unpack("<5f", struct.pack("<5f", *(k * step for step in steps))) for k in range(3000)]
    with open(path, "w", newline="") as file:
        csv.writer(file).writerows([list(axes), *rows])
    command = [board.trueaxis, "eval", blobs[0], "--positions", path]
    out = subprocess.run(command, capture_output=True, text=True, check=True)
    wanted = [[float(x) for x in line.split(",")] for line in out.stdout.split()[1:]]
    board.place = rows[0]
    said = board.says("control", "enable")
    holds("-> enabled" in said, said)
    board.settle()
    state = board.state()
    holds(state["enabled"] and state["factor"] == 1.0 and state["fault"] is None, f"{state}")
    holds(state["health"]["frames"] > 1000 and state["health"]["damaged"] == 0, f"{state}")
    compared = 0
    for k, board.place in enumerate(rows):
        number, flags, _, corrections = answered(board.period())
        holds(number == board.count - 1 & 0xFF, f"answers {number} instead of the command before {board.count}")
        holds(flags == 3, f"a fault in frame {k}")
        # The backlash of the first millimetres is taken up at its own rate.
        if k > 1000:
            expected = struct.pack(f"<{AXES}f", *wanted[k - 1], *[0.0] * (AXES - len(axes)))
            holds(corrections == expected, f"row {k}: {struct.unpack('<8f', corrections)} and not {wanted[k - 1]}")
            compared += 1
    holds(board.chip.options >> 2 & 3 == 0, "the brown-out level is not 3")
    return f"{compared} answers have every digit of eval"


def cut(board, blobs, _):
    """The power is cut at operations of the flash: afterwards the old or the new one is in use, complete."""
    chip = board.chip
    board.says("flash", blobs[0], "--activate")
    before = chip.operations
    board.says("flash", blobs[1], "--activate")
    length = chip.operations - before
    chance = random.Random(1)
    moments = [*range(1, 7), *sorted(chance.sample(range(7, length - 12), 6)), *range(length - 11, length + 1)]
    for k, moment in enumerate(moments):
        blob = blobs[k % 2]
        chip.cut_at = chip.operations + moment
        board.says("flash", blob, "--activate", code=None)
        # An upload that went on where it was may need fewer.
        chip.cut_at = None
        board.settle()
        holds(board.in_use().endswith("in use") and "none" not in board.in_use(), f"nothing is in use, cut {moment}")
        board.says("flash", blob, "--activate")
    return f"{board.cuts} cuts at {len(moments)} of the {length} operations of an upload"


def refused(board, blobs, _):
    """A word that cannot be programmed: the upload is refused, and the old one stays in use."""
    board.says("flash", blobs[0], "--activate")
    use = board.in_use()
    board.chip.refuse = lambda address: address == SLOT_B + 0x400
    said = board.says("flash", blobs[1], "--activate", code=2)
    holds(board.in_use() == use, said)
    board.chip.cut()
    board.settle()
    holds(board.in_use() == use, "another one after a restart")
    board.chip.refuse = lambda address: False
    board.says("flash", blobs[1], "--activate")
    return said.splitlines()[0].split(": ")[-1]


def watchdog(board, blobs, _):
    """The clock of the servo stops: the chip restarts, with corrections off, and says why."""
    board.says("flash", blobs[0], "--activate")
    board.says("control", "reference", "all")
    board.says("control", "enable")
    starts = board.chip.starts
    board.chip.ticking = False
    periods = 0
    while board.chip.starts == starts:
        board.period()
        periods += 1
        holds(periods <= 100, "no restart within 25 ms")
    board.chip.ticking = True
    state = board.state()
    holds(not state["enabled"] and state["compensation"].endswith("in use"), f"{state}")
    holds("watchdog" in state["health"]["restart"], state["health"]["restart"])
    return f"after {periods * 0.25:.1f} ms: {state['health']['restart']}"


def cable(board, blobs, _):
    """A cable that drops during an upload: the next one goes on."""
    board.says("flash", blobs[0], "--activate")
    board.drops_after = 6000
    board.says("flash", blobs[1], "--activate", code=2)
    said = board.says("flash", blobs[1], "--activate")
    holds("from byte" in said, said)
    return said.splitlines()[1].split(": ", 1)[1]


def bus(board, blobs, _):
    """A sensor bus that is stuck low stops nothing."""
    board.chip.sensor_bus = 0
    board.chip.cut()
    for _ in range(4):
        board.settle()
    board.says("flash", blobs[0], "--activate")
    holds(board.in_use() == "slot A in use", "not in use")
    return "2 s with the bus stuck, then an upload"


def moving(board, blobs, _):
    """An upload while the drives are on is refused: the flash would stall the servo."""
    board.chip.drives_off = False
    said = board.says("flash", blobs[0], code=2)
    holds("standstill" in said and not any(board.chip.erases), said)
    return "an upload with the drives on is refused"


def main():
    image, trueaxis, folder = sys.argv[1:4]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    blobs = []
    for errors in ("errors-12", "errors-10"):
        blob = folder / f"{errors}.trax"
        files = [EXAMPLES / "kolibri" / "machine.toml", EXAMPLES / "kolibri" / f"{errors}.toml"]
        subprocess.run([trueaxis, "compile", *files, "-o", blob], check=True, capture_output=True)
        blobs.append(blob)
    failed = False
    chosen = sys.argv[4:]
    for part in (used, cut, refused, watchdog, cable, bus, moving):
        if chosen and part.__name__ not in chosen:
            continue
        try:
            verdict = "ok      " + part(Board(image, trueaxis), blobs, folder)
        except (Failed, Wrong) as why:
            failed, verdict = True, f"FAILED  {why}"
        print(f"stm32f405   {part.__name__:<17} {verdict}", flush=True)
    return failed


if __name__ == "__main__":
    sys.exit(main())
