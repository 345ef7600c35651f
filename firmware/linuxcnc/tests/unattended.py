#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""For tests only: takes the place of the user interface, switches the machine on, and runs the lines of /tmp/commands.

What they print goes to /tmp/printed, and their exit codes to /tmp/codes; LinuxCNC ends after the last one.
"""
import subprocess

import linuxcnc

command = linuxcnc.command()
for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
    command.state(state)
    command.wait_complete()
with open("/tmp/printed", "w") as printed, open("/tmp/codes", "w") as codes:
    for line in open("/tmp/commands"):
        done = subprocess.run(line, shell=True, stdout=printed, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
        print(done.returncode, file=codes, flush=True)
