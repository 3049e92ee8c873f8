"""The resistive network of the matrix: what a pair of terminals sees of all its tactels.

Thesis 4.2, figure 4.5. Conductances (..., rows, columns) in S -> resistances in ohm, or
transconductances in S. Columns are eliminated first (they have no tactel in common), then
the rows one after another with sums of positive terms alone (Grassmann, Taksar, Heyman), so
that the relative error stays at rounding whatever the contrast: 31 pivots instead of one
31x31 inverse, which loses a digit for every decade of contrast.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.circuit.fsr import Image
from probe.errors import CircuitError


@dataclass(frozen=True, slots=True, eq=False)
class Network:
    """A network with all terminals open, eliminated.

    A current of 1 A into row r and out of column c gives the potentials' difference
    `modes[..., r, c] . modes[..., r', c'] + (c == c') / sums[..., c]` between row r' and
    column c'.
    """

    sums_s: NDArray[np.float64]  #: (..., columns) S, conductance of every column
    pivots_s: NDArray[np.float64]  #: (..., rows - 1) S
    modes: NDArray[np.float64]  #: (..., rows - 1, rows, columns) sqrt(ohm)

    @property
    def resistances_ohm(self) -> Image:
        """(..., rows, columns) ohm between every row and column."""
        own: Image = (self.modes**2).sum(axis=-3) + 1.0 / self.sums_s[..., None, :]
        return own

    @property
    def logdet(self) -> NDArray[np.float64]:
        """Logarithm of the determinant of the Laplacian with one node grounded."""
        value: NDArray[np.float64] = np.log(self.sums_s).sum(-1) + np.log(self.pivots_s).sum(-1)
        return value

    def transfer_ohm(self) -> NDArray[np.float64]:
        """(tactels, tactels) ohm: current through one pair, voltage over another; one network."""
        count, rows, columns = self.modes.shape
        flat = self.modes.reshape(count, rows * columns)
        transfer: NDArray[np.float64] = flat.T @ flat
        by_column = transfer.reshape(rows, columns, rows, columns)
        index = np.arange(columns)
        by_column[:, index, :, index] += (1.0 / self.sums_s)[:, None, None]
        return transfer


def eliminate(conductance_s: ArrayLike) -> Network:
    """Eliminate a network whose terminals are all open.

    Raises
    ------
    CircuitError
        If a conductance is negative or no number, or the network falls into parts.
    """
    g = checked_conductances(conductance_s)
    rows = g.shape[-2]
    sums = g.sum(axis=-2)
    if not ((g.sum(axis=-1) > 0).all() and (sums > 0).all()):
        raise _disconnected_error()
    shares = g / sums[..., None, :]
    joined = shares @ np.swapaxes(g, -1, -2)
    modes = _sources(shares)
    pivots = np.empty((*g.shape[:-2], rows - 1))
    for k in range(rows - 1):
        row = joined[..., k, k + 1 :]
        pivot = row.sum(axis=-1)
        if not (pivot > 0).all():
            raise _disconnected_error()
        share = row / pivot[..., None]
        joined[..., k + 1 :, k + 1 :] += row[..., :, None] * share[..., None, :]
        modes[..., k + 1 :, :, :] += share[..., :, None, None] * modes[..., k : k + 1, :, :]
        pivots[..., k] = pivot
    scaled = modes[..., :-1, :, :] / np.sqrt(pivots)[..., None, None]
    return Network(sums, pivots, scaled)


def effective_resistances(conductance_s: ArrayLike) -> Image:
    """Return the resistance (ohm) between every row and column, all others open.

    Parameters
    ----------
    conductance_s
        (..., rows, columns) S; at least so many above 0 that the network holds together.

    References
    ----------
    Foster: the sum of conductance times resistance is rows + columns - 1.
    """
    return eliminate(conductance_s).resistances_ohm


def transconductances(
    conductance_s: ArrayLike, row_ohm: float = 0.0, column_ohm: float = 0.0
) -> Image:
    """Return the current out of every column per volt on every row, the other rows at 0 V.

    Every row is fed through `row_ohm`, every column led to ground through `column_ohm`.

    Returns
    -------
    (..., rows, columns) S; equal to the conductances where both resistances are 0.
    """
    g = checked_conductances(conductance_s)
    share = 1.0 / (1.0 + column_ohm * g.sum(axis=-2))
    led: Image = g * share[..., None, :]
    if row_ohm == 0:
        return led
    between = column_ohm * (led @ np.swapaxes(g, -1, -2))
    index = np.arange(g.shape[-2])
    between[..., index, index] = 0.0
    system = -row_ohm * between
    system[..., index, index] = 1.0 + row_ohm * (between.sum(axis=-1) + led.sum(axis=-1))
    return np.asarray(np.linalg.solve(system, led), dtype=np.float64)


def transfers(conductance_s: Image, row_ohm: float, column_ohm: float) -> NDArray[np.float64]:
    """Return the derivative of `transconductances` by the conductances of one network.

    Returns
    -------
    (tactels, tactels): a row for each reading, a column for each conductance. By reciprocity
    an entry is the voltage over the tactel from the row that is driven, times that from the
    column that is read, if that were driven.
    """
    rows, columns = conductance_s.shape
    count = rows + columns
    system = np.zeros((count, count))
    system[:rows, rows:] = -conductance_s
    system[rows:, :rows] = -conductance_s.T
    system *= np.r_[np.full(rows, row_ohm), np.full(columns, column_ohm)][:, None]
    index = np.arange(count)
    system[index, index] = 1.0 - system.sum(axis=1)
    led = np.linalg.inv(system)  # potential of a node (first index) per volt that feeds one
    over = led[:rows, None, :] - led[None, rows:, :]
    from_row, from_column = over[..., :rows], -over[..., rows:]
    slopes: NDArray[np.float64] = np.einsum("abr,abc->rcab", from_row, from_column, optimize=True)
    return slopes.reshape(rows * columns, rows * columns)


def checked_conductances(conductance_s: ArrayLike) -> Image:
    """Return conductances as floats, (..., rows, columns), if they are conductances."""
    g = np.asarray(conductance_s, dtype=np.float64)
    if g.ndim < 2 or min(g.shape[-2:]) < 2:
        raise CircuitError(
            f"conductances of shape {g.shape}", fix="give (..., rows, columns), 2x2 or more"
        )
    if not (np.isfinite(g).all() and (g >= 0).all()):
        raise CircuitError(
            "a conductance is negative or no number", fix="give 0 or more, in siemens"
        )
    return g


def _sources(shares: Image) -> NDArray[np.float64]:
    """Return what 1 A into each row and out of each column injects into the rows."""
    rows = shares.shape[-2]
    injected = np.repeat(-shares[..., :, None, :], rows, axis=-2)
    index = np.arange(rows)
    injected[..., index, index, :] += 1.0
    return injected


def _disconnected_error() -> CircuitError:
    return CircuitError(
        "the network falls into parts that no conductance joins",
        fix="give every tactel at least its leak, say 1e-8 S",
    )
