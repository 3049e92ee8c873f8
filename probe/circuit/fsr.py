"""The law of a force sensing resistor: force on each tactel -> its conductance. Thesis 4.2.

Above a break force the conductance rises with a power of the force; a series resistance
bounds it. On the way back a tactel reads higher than on the way up (rate independent
hysteresis: a play operator that widens with the force), and under a load it creeps by a
share per decade of time. Both are in `FilmState`, a value that goes in and comes out.

    g0 = gain (e - break)^exponent (1 + drift log10(1 + age / 1 s)),  e in N,
    g  = leak + 1 / (1 / g0 + series),
    e  = the old e, clipped to [F, F (1 + hysteresis)]  where F = force + preload.

N, S (siemens), ohm, s. Arrays are (rows, columns), tactel (0, 0) top left. Figures: Interlink
400 series; thesis 4.2 gives two decades of resistance for 1 to 100 N/cm^2, which is 0.025 to
2.5 N on a tactel of 1.5875 mm.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.errors import CircuitError

Image = NDArray[np.float64]  #: (..., rows, columns)

# The usual film: Interlink 400 series, as a tactel of 1.5875 mm has it.
GAIN_S = 1e-4  #: at 1 N above the break force: 10 kOhm
BREAK_N = 0.01  #: least force that is read: 0.4 N/cm^2
SERIES_OHM = 500.0  #: at any force
LEAK_S = 5e-8  #: 20 MOhm unloaded
MOST_N = 1e12  # beyond it nothing changes: the series resistance holds


_USUAL = SensorType()


@dataclass(frozen=True, slots=True, eq=False)
class Fsr:
    """The law of every tactel of one matrix."""

    gain_s: Image  #: (rows, columns) S at 1 N above the break force; > 0
    exponent: Image  #: (rows, columns) > 0
    break_n: Image  #: (rows, columns) N, least force that is read
    preload_n: Image  #: (rows, columns) N, pressed by the assembly itself
    series_ohm: Image  #: (rows, columns) least resistance
    stuck_s: Image  #: (rows, columns) S, held whatever the force; 0 where the tactel moves
    dead: NDArray[np.bool_]  #: (rows, columns) open: leaks, reads no force
    leak_s: float = LEAK_S  #: S, unloaded
    hysteresis: float = 0.10  #: reading on the way back over the way up, less 1
    drift: float = 0.05  #: rise of the conductance per decade of time under load

    def __post_init__(self) -> None:
        shape = np.shape(self.gain_s)
        for item in fields(self)[:7]:
            values = np.array(getattr(self, item.name), bool if item.name == "dead" else float)
            if values.ndim != 2 or values.shape != shape or not np.isfinite(values).all():
                raise CircuitError(
                    f"{item.name} has shape {values.shape} or holds values that are no numbers, "
                    f"it must be finite and of shape {shape}",
                    fix="give one value per tactel",
                )
            if item.name in ("gain_s", "exponent") and (values <= 0).any():
                raise CircuitError(f"{item.name} holds {values.min():g}", fix="give values above 0")
            if (values < 0).any():
                raise CircuitError(f"{item.name} holds {values.min():g}", fix="give 0 or more")
            values.setflags(write=False)
            object.__setattr__(self, item.name, values)
        if not (0 < self.leak_s < np.inf and 0 <= self.hysteresis < np.inf and self.drift >= 0):
            raise CircuitError(
                f"leak {self.leak_s:g} S, hysteresis {self.hysteresis:g}, drift {self.drift:g}",
                fix="give a leak above 0 (a network without it falls apart), the others 0 or more",
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.gain_s.shape
        return rows, columns


@dataclass(frozen=True, slots=True, eq=False)
class FilmState:
    """Memory of the tactels from one frame to the next; shape of the forces."""

    effective_n: Image  #: N, the force that the film shows (play operator)
    age_s: Image  #: s under load, mean over the load
    flutter: Image  #: the noise of the contact, unit variance


@lru_cache(maxsize=16)
def fsr_of(rows: int = _USUAL.rows, columns: int = _USUAL.columns) -> Fsr:
    """Return a matrix of equal, sound tactels."""
    one, none = np.ones((rows, columns)), np.zeros((rows, columns))
    return Fsr(GAIN_S * one, one, BREAK_N * one, none, SERIES_OHM * one, none, none > 0)


def conductances(
    fsr: Fsr, forces_n: ArrayLike, state: FilmState | None = None, elapsed_s: float = 0.0
) -> tuple[Image, FilmState]:
    """Return the conductance of every tactel (..., rows, columns), S, and its new state.

    Forces are of that shape, N, 0 or more; leading axes are independent touches. `state` is of the
    frame before, `elapsed_s` ago; None for a matrix that was not loaded yet. Its noise is carried
    on as it was. Raises CircuitError: a force is negative or no number, or a shape is wrong.
    """
    force = checked_forces(fsr, forces_n) + fsr.preload_n
    if state is None:
        nothing = np.zeros(force.shape)
        state = FilmState(nothing, nothing, nothing)
    elif state.effective_n.shape != force.shape:
        raise CircuitError(
            f"the state has shape {state.effective_n.shape}, the forces {force.shape}",
            fix="carry one state along with one sequence of frames, or give None",
        )
    effective = np.clip(state.effective_n, force, force * (1.0 + fsr.hysteresis))
    more = effective > state.effective_n
    kept = np.divide(state.effective_n, effective, out=np.ones(force.shape), where=more)
    age = np.where(effective > 0, (state.age_s + elapsed_s) * kept, 0.0)
    crept = 1.0 + fsr.drift * np.log10(1.0 + age)
    over = np.minimum(np.maximum(effective - fsr.break_n, 0.0), MOST_N)
    film = fsr.gain_s * over**fsr.exponent * crept
    shown = np.where(fsr.dead, fsr.leak_s, fsr.leak_s + film / (1.0 + film * fsr.series_ohm))
    shown = np.where(fsr.stuck_s > 0, fsr.stuck_s, shown)
    return shown, FilmState(effective, age, state.flutter)


def checked_forces(fsr: Fsr, forces_n: ArrayLike) -> Image:
    """Return forces as floats, (..., rows, columns), if they are forces."""
    force = np.asarray(forces_n, dtype=np.float64)
    if force.shape[-2:] != fsr.shape:
        raise CircuitError(
            f"the forces have shape {force.shape}, the matrix {fsr.shape}",
            fix="give (rows, columns) or (N, rows, columns) forces in N",
        )
    if not (np.isfinite(force).all() and (force >= 0).all()):
        raise CircuitError(
            f"{int((~(force >= 0) | ~np.isfinite(force)).sum())} forces are below 0 N or no "
            "numbers; a tactel is pressed by 0 N or more",
            fix="give the forces of a contact",
        )
    return force
