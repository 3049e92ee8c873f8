"""A matrix read through two multiplexers, some of whose rows float: voltages of the column.

The row that is read is at the supply; the other rows are at ground, or float where nothing holds
them. Of the columns the one that is read is loaded to ground, the others are open. With no row
floating this is the divider of a loaded column, v = g / (sum of the column + 1 / load), with
all of them it is figure 4.5 of the thesis; between the two the unselected rows that
float carry ghosts. Thesis 4.2.

For every row the nodes that nothing holds (all columns, the floating rows) are eliminated once:
what a column shows unloaded, and the resistance behind it (Thevenin), tell what it shows loaded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.circuit.fsr import Image
from probe.circuit.network import checked_conductances
from probe.errors import CircuitError


def loaded_columns(conductance_s: ArrayLike, floating: NDArray[np.bool_], load_ohm: float) -> Image:
    """Return the voltage over the load, as a share of the supply, for every row and column.

    Parameters
    ----------
    conductance_s
        (rows, columns) S; above 0 where a column would hang in the air otherwise.
    floating
        (rows,) whether a row floats while another one is read.
    load_ohm
        From the column that is read to ground.

    Raises
    ------
    CircuitError
        A shape is wrong, the load is not above 0, or a node is joined to nothing.
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
