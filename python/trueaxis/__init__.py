"""Geometric errors of machine tools and their compensation.

Positions and corrections are in mm and degrees, error parameters in mm and rad, as in the files of the command
``trueaxis``. Positions are arrays, lists, or tables with named columns; objects are immutable, and can be compared,
copied and pickled. Bad input raises :class:`Error` with ``message``, ``remedy``, ``file`` and ``line``; doubts are
:class:`TrueaxisWarning`. Drawings are in ``trueaxis.plot``, which needs matplotlib.
"""

import copyreg as _copyreg

from . import _native
from ._native import (
    Compensation,
    Error,
    Errors,
    Identified,
    Machine,
    Probings,
    TrueaxisWarning,
    __version__,
    compile,
    correct,
    identify,
    pose,
    simulate,
)

# Without `compile`, which `from trueaxis import *` must not put in place of Python's own.
__all__ = [
    "Compensation",
    "Error",
    "Errors",
    "Identified",
    "Machine",
    "Probings",
    "TrueaxisWarning",
    "correct",
    "identify",
    "pose",
    "simulate",
]


def _restored(kind, state):
    return getattr(_native, kind)._restored(*state)


def _reduced(whole):
    return _restored, (type(whole).__name__, whole._state())


for _kind in (Compensation, Errors, Identified, Machine, Probings):
    _copyreg.pickle(_kind, _reduced)
