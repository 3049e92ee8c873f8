"""The resistive network of the matrix: resistances between its terminals, and back. Thesis 4.2.

Conductances (..., rows, columns) in S -> resistances in ohm, or transconductances in S (figure
4.5). Columns are eliminated first (they have no tactel in common), then
the rows one after another with sums of positive terms alone (Grassmann, Taksar, Heyman), so
that the relative error stays at rounding whatever the contrast: 31 pivots instead of one
31x31 inverse, which loses a digit for every decade of contrast.

`loaded_columns` is a matrix read through two multiplexers, some of whose rows float: the row that
is read is at the supply; the other rows are at ground, or float where nothing holds them. The
column that is read is loaded to ground, the others are open. With no row floating this is the
divider of a loaded column, v = g / (sum of the column + 1 / load), with all of them figure 4.5 of
the thesis; between the two the unselected rows that float carry ghosts. For every row the nodes
that nothing holds (all columns, the floating rows) are eliminated once: the unloaded voltage of a
column and the resistance behind it (Thevenin) give its loaded voltage.

`solve_floating` inverts floating rows. All resistances R of a network determine all its
conductances g: they minimise the strictly convex

    -logdet L(g) + <R, g>,  g >= 0,

because R is the gradient of logdet L. In y = g R the Hessian has a unit diagonal at the
solution (by g alone its rows differ by the square of the contrast, and steps stall); Foster:
the sum of y is rows + columns - 1, each y at most 1. Each step minimises the quadratic model
over y >= 0 (block pivoting), and goes along it until the function falls. Where y = gR falls to the
relative noise of R the reading is that of the neighbours' paths, and says nothing of the tactel.

References
----------
J. J. Judice and F. M. Pires, block principal pivoting for quadratic programmes with bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.circuit.fsr import Image
from probe.errors import CircuitError

Vector = NDArray[np.float64]

MOST_STEPS = 60
MOST_PIVOTS = 200  # of one step
BLOCK_PIVOTS = 6  # without progress before single ones
NEAR = 1e-3  # squared Newton decrement; -logdet is self-concordant: full steps converge
DECREASE = 1e-4  # share of the predicted decrease that a step must keep
HALVINGS = 40  # of one step


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

    Raises CircuitError: a conductance is negative or no number, or the network falls into parts.
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

    `conductance_s` is (..., rows, columns) S; enough of them above 0 to hold the network together.
    """
    return eliminate(conductance_s).resistances_ohm


def transconductances(
    conductance_s: ArrayLike, row_ohm: float = 0.0, column_ohm: float = 0.0
) -> Image:
    """Return the current out of every column per volt on every row, the other rows at 0 V.

    Every row is fed through `row_ohm`, every column led to ground through `column_ohm`. (..., rows,
    columns) S; equal to the conductances where both resistances are 0.
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

    (tactels, tactels): a row for each reading, a column for each conductance. By reciprocity an
    entry is the voltage over the tactel from the row that is driven, times that from the column
    that is read, if that were driven.
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
    """Return the currents in the rows, of 1 A into each row and out of each column."""
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


def loaded_columns(conductance_s: ArrayLike, floating: NDArray[np.bool_], load_ohm: float) -> Image:
    """Return the voltage over the load, as a share of the supply, for every row and column.

    Conductances (rows, columns) are above 0 where a column would hang in the air otherwise;
    `floating` (rows,) tells the rows that float while another one is read; the load lies between
    the column that is read and ground. Raises CircuitError: a shape is wrong, the load is not above
    0, or a node is joined to nothing.
    """
    g = checked_conductances(conductance_s)
    if g.ndim != 2 or np.shape(floating) != g.shape[:1] or not load_ohm > 0:
        raise CircuitError(
            f"conductances {g.shape}, floating rows {np.shape(floating)}, load {load_ohm:g} ohm",
            fix="give (rows, columns), one truth for each row, and a load above 0",
        )
    if not np.any(floating):
        divider: Image = g / (g.sum(axis=0) + 1.0 / load_ohm)
        return divider
    share = np.empty(g.shape)
    for row in range(len(g)):
        open_rows = np.flatnonzero(floating & (np.arange(len(g)) != row))
        between = g[open_rows]  # conductances among the nodes that nothing holds
        system = np.diag(np.r_[g.sum(axis=0), between.sum(axis=1)])
        columns = g.shape[1]
        system[:columns, columns:] = -between.T
        system[columns:, :columns] = -between
        try:
            inverse = np.linalg.inv(system)
        except np.linalg.LinAlgError as error:
            raise CircuitError(
                "a column or a floating row is joined to nothing",
                fix="give every tactel at least its leak, say 1e-8 S",
            ) from error
        driven = np.r_[g[row], np.zeros(len(open_rows))]
        unloaded, behind = (inverse @ driven)[:columns], np.diagonal(inverse)[:columns]
        share[row] = unloaded * load_ohm / (load_ohm + behind)
    return share


EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True, eq=False)
class FloatingSolution:
    """A network found from its resistances."""

    conductance_s: Image  #: (rows, columns) S, 0 or more
    own: Image  #: (rows, columns) y = gR, how much of a reading is the tactel's own
    hessian: NDArray[np.float64]  #: (tactels, tactels) -d ln R / d y
    steps: int


def solve_floating(resistance_ohm: Image, tolerance: float = 1e-9) -> FloatingSolution:
    """Find the conductances of a network from all its resistances.

    `resistance_ohm` (rows, columns) is between every row and column with all others open; > 0.
    `tolerance` is the largest relative change of a conductance in the last step. Raises
    CircuitError: a resistance is not above 0, or the steps do not end.
    """
    if not (np.isfinite(resistance_ohm).all() and (resistance_ohm > 0).all()):
        raise CircuitError(
            "a resistance between terminals is not above 0, or no number",
            fix="read within the ADC's range: lower the load, or press less",
        )
    shape = resistance_ohm.shape
    scale = float(np.exp(np.log(resistance_ohm).mean()))
    measured = resistance_ohm / scale
    y = np.full(measured.size, (sum(shape) - 1) / measured.size)
    network = eliminate(y.reshape(shape) / measured)
    free = np.ones(y.size, dtype=np.bool_)
    for steps in range(1, MOST_STEPS + 1):
        gradient = 1.0 - (network.resistances_ohm / measured).ravel()
        hessian = _hessian(network, measured)
        wanted, free = _minimise_bounded(hessian, gradient - hessian @ y, free)
        move = wanted - y
        misfit = float(np.abs(gradient[free]).max(initial=0.0))
        if (np.abs(move) <= tolerance * y).all() or misfit <= 64 * EPSILON:
            conductance = y.reshape(shape) / measured / scale
            return FloatingSolution(conductance, y.reshape(shape), hessian, steps)
        y, network = _search_line(y, move, gradient, network, measured)
    raise CircuitError(
        f"the network did not settle in {MOST_STEPS} steps; misfit {misfit:.1e}",
        fix="the readings contradict each other: average more frames",
    )


def _hessian(network: Network, measured: Image) -> NDArray[np.float64]:
    root = np.sqrt(measured.ravel())
    transfer = network.transfer_ohm()
    transfer /= root[:, None]
    transfer /= root
    return np.square(transfer, out=transfer)


def _minimise_bounded(
    hessian: NDArray[np.float64], linear: Vector, free: NDArray[np.bool_]
) -> tuple[Vector, NDArray[np.bool_]]:
    """Minimise z' hessian z / 2 + linear' z over z >= 0; start from a guess of what is free."""
    blocks, fewest = BLOCK_PIVOTS, linear.size + 1
    for _ in range(MOST_PIVOTS):
        z = _minimise_free(hessian, linear, free)
        slope = hessian @ z + linear
        wrong = (free & (z < 0)) | (~free & (slope < -64 * EPSILON))
        number = int(wrong.sum())
        if number == 0:
            return z, free
        if number < fewest:
            blocks, fewest = BLOCK_PIVOTS, number
        elif blocks > 0:
            blocks -= 1
        else:
            last = int(np.flatnonzero(wrong)[-1])
            wrong = np.zeros_like(free)
            wrong[last] = True
        free = free ^ wrong
    return np.maximum(z, 0.0), free


def _minimise_free(hessian: NDArray[np.float64], linear: Vector, free: NDArray[np.bool_]) -> Vector:
    """Minimise with the variables that are not free held at 0."""
    from scipy.linalg import cho_factor, cho_solve

    index = np.flatnonzero(free)
    part = hessian[index[:, None], index]
    weight = 1.0 / np.sqrt(np.diagonal(part))
    part *= weight[:, None]
    part *= weight
    part[np.diag_indices_from(part)] += 4 * EPSILON
    factor = cho_factor(part, lower=True, overwrite_a=True, check_finite=False)
    z = np.zeros_like(linear)
    z[index] = -weight * cho_solve(factor, weight * linear[index], check_finite=False)
    return z


def _search_line(
    y: Vector, move: Vector, gradient: Vector, network: Network, measured: Image
) -> tuple[Vector, Network]:
    """Go along the step until the function falls; stay if it does not."""
    value = float(y.sum() - network.logdet)
    slope = float(gradient @ move)
    length = 1.0
    for _ in range(HALVINGS):
        there = np.maximum(y + length * move, 0.0)
        try:
            ahead = eliminate(there.reshape(measured.shape) / measured)
        except CircuitError:
            length /= 2
            continue
        allowed = value + DECREASE * length * slope
        if -slope < NEAR or there.sum() - ahead.logdet <= allowed:
            return there, ahead
        length /= 2
    return y, network
