from os import PathLike
from typing import Literal, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

Path = Union[str, PathLike[str]]
Positions = Union[npt.NDArray[np.float64], npt.NDArray[np.float32]]
Policy = Literal["direction", "orientation", "position"]

class Error(ValueError):
    """Bad input: what is wrong, what to do, and where, if it is in a file or a text."""

    message: str
    remedy: str
    file: Optional[str]
    line: Optional[int]

class Machine:
    """A machine: its axes, spindle, tool and workpiece."""

    @staticmethod
    def from_file(path: Path) -> Machine: ...
    @staticmethod
    def from_toml(text: str) -> Machine: ...
    @property
    def name(self) -> str: ...
    @property
    def axes(self) -> list[str]:
        """Letters of the axes, in the order of the columns of positions."""
    @property
    def travel(self) -> npt.NDArray[np.float64]:
        """Ends of the travel of each axis (mm, deg): one row per axis."""

class Errors:
    """The error parameters of a machine."""

    @staticmethod
    def from_file(path: Path, machine: Machine) -> Errors: ...
    @staticmethod
    def from_toml(text: str, machine: Machine) -> Errors: ...
    @staticmethod
    def perfect(machine: Machine) -> Errors: ...
    @property
    def parameters(self) -> dict[str, float]:
        """Parameters by name (mm, rad, per mm or rad to the degree); measured motions are not among them."""
    @property
    def standard_uncertainty(self) -> dict[str, float]: ...

class Compensation:
    """Tables that correct the errors of a machine."""

    @staticmethod
    def from_file(path: Path) -> Compensation: ...
    @staticmethod
    def from_bytes(blob: bytes) -> Compensation: ...
    def to_bytes(self) -> bytes: ...
    def save(self, path: Path) -> None: ...
    @property
    def machine(self) -> str: ...
    @property
    def axes(self) -> list[str]: ...
    @property
    def inputs(self) -> list[str]:
        """Names of the columns of positions: the axes, then the tool length (mm) and temperatures (K)."""
    @property
    def policy(self) -> str: ...
    @property
    def warnings(self) -> list[str]:
        """What ``trueaxis compile`` warns of; empty for a compensation that was read."""
    def evaluate(self, positions: Positions, *, motion: bool = True) -> npt.NDArray[np.float32]:
        """Corrections (mm, deg) before the guard rails, one row per position, as the controller computes them.

        With ``motion``, the order of the rows is the motion, which gives the direction of travel; without, directions are
        unknown. The array is read in place, and other threads run meanwhile.
        """

class Probings:
    """Positions of the axes with the stylus on balls."""

    @staticmethod
    def from_file(path: Path, machine: Machine) -> Probings: ...
    @staticmethod
    def from_csv(text: str, machine: Machine) -> Probings: ...
    def to_csv(self) -> str: ...
    def save(self, path: Path) -> None: ...
    @property
    def positions(self) -> npt.NDArray[np.float64]: ...
    @property
    def balls(self) -> list[str]:
        """The ball of each row."""
    def __len__(self) -> int: ...

class Identified:
    """Error parameters that were found."""

    @property
    def errors(self) -> Errors: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def standard_uncertainty(self) -> dict[str, float]: ...
    @property
    def noise_um(self) -> float:
        """Standard deviation of one coordinate of a probing (µm), from the residuals."""
    @property
    def unseen(self) -> int:
        """Number of unknowns that could not be identified."""
    @property
    def warnings(self) -> list[str]:
        """What to check before the parameters are trusted, as ``trueaxis identify`` prints it."""
    @property
    def is_doubtful(self) -> bool:
        """True where ``trueaxis identify`` exits with 1: rows contradict each other."""
    def to_json(self) -> str:
        """What ``trueaxis identify --json`` prints."""
    def save(self, path: Path) -> None:
        """Writes the error file, and its covariances beside it."""

def pose(
    machine: Machine, positions: Positions, errors: Optional[Errors] = None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Tip (mm) and direction of the tool in the workpiece frame, one row per position; rows are a motion."""

def correct(
    machine: Machine,
    errors: Errors,
    positions: Positions,
    *,
    policy: Policy = "direction",
    damping: Optional[float] = None,
) -> npt.NDArray[np.float64]:
    """Exact kinematic corrections (mm, deg), one row per position; rows are a motion."""

def compile(
    machine: Machine,
    errors: Errors,
    *,
    policy: Policy = "direction",
    damping: Optional[float] = None,
    tolerance: Optional[float] = None,
    scheme: str = "exact",
    target: str = "stm32f405",
    zero_at: Optional[Sequence[float]] = None,
    best_effort: bool = False,
    allow_large: bool = False,
    random: int = 20_000,
    seed: int = 1,
) -> Compensation:
    """Makes and proves a compensation; the options are those of ``trueaxis compile``. ``tolerance`` is in µm."""

def simulate(
    machine: Machine,
    errors: Errors,
    *,
    artefact: Path,
    strategy: Path,
    noise: float = 0.0,
    seed: int = 1,
) -> Probings:
    """Probings as a machine with these errors would give them, with noise (µm) of each coordinate."""

def identify(
    machine: Machine,
    probings: Optional[Probings] = None,
    *,
    artefact: Optional[Path] = None,
    observations: Sequence[Path] = (),
    model: str = "auto",
    robust: bool = False,
    without: Sequence[str] = (),
    accept_places: bool = False,
) -> Identified:
    """Error parameters from probings and files of observations; options and refusals are those of ``trueaxis identify``."""
