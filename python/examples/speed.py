"""Processor time of a million evaluations on one thread: `python speed.py MACHINE.toml ERRORS.toml`."""

import sys
import time

import numpy as np

import trueaxis


def main(machine_file, errors_file):
    machine = trueaxis.Machine.from_file(machine_file)
    errors = trueaxis.Errors.from_file(errors_file, machine)
    compensation = trueaxis.compile(machine, errors)
    low, high = machine.travel.T
    for dtype in (np.float64, np.float32):
        positions = np.random.default_rng(1).uniform(low, high, (1_000_000, len(low))).astype(dtype)
        best = float("inf")
        for _ in range(20):
            start = time.process_time()
            compensation.evaluate(positions)
            best = min(best, time.process_time() - start)
        print(f"{dtype.__name__}: {1e3 * best:.0f} ms of one processor, the fastest of 20 times")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
