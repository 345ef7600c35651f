"""Geometric errors of machine tools and their compensation.

Positions and corrections are in mm and degrees, error parameters in mm and rad, as in the files of the command
``trueaxis``. Bad input raises :class:`Error` with ``message``, ``remedy``, ``file`` and ``line``.
"""

from ._native import (
    Compensation,
    Error,
    Errors,
    Identified,
    Machine,
    Probings,
    compile,
    correct,
    identify,
    pose,
    simulate,
)

__all__ = [
    "Compensation",
    "Error",
    "Errors",
    "Identified",
    "Machine",
    "Probings",
    "compile",
    "correct",
    "identify",
    "pose",
    "simulate",
]
