"""Force laws of a compressed column: linear, and neo-Hookean. Thesis 4.2.

A law gives force (N) and tangent (N/mm) at a compression (mm); the force is rising and
continuous, so the work done is convex. The neo-Hookean column, incompressible and free to
slide at its ends, has the nominal stress

    sigma = (E/3) (lambda^-2 - lambda),    lambda = 1 - compression / length,

which grows without bound as the column is crushed: no force gives an impossible strain.

References: R. S. Rivlin, "Large elastic deformations of isotropic materials IV", Phil. Trans.
R. Soc. A 241 (1948) 379-397.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_STRETCH = 1e-9  # below, only rounding goes


class Law(Protocol):
    """How an elastic body answers to compression."""

    @property
    def length_mm(self) -> float:
        """The compression that no force reaches; inf where there is none."""
        ...

    def __call__(self, compression_mm: Array) -> tuple[Array, Array]:
        """Return force (N) and tangent (N/mm) at each compression below the length."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A spring."""

    stiffness: Array | float  #: N/mm; one for all, or one for each compression
    length_mm: float = math.inf

    def __call__(self, compression_mm: Array) -> tuple[Array, Array]:
        """Return force (N) and tangent (N/mm)."""
        return self.stiffness * compression_mm, np.broadcast_to(
            np.asarray(self.stiffness, dtype=np.float64), compression_mm.shape
        )


@dataclass(frozen=True, slots=True, eq=False)
class NeoHooke:
    """A column of an incompressible neo-Hookean solid."""

    stiffness: Array | float  #: N/mm at no strain: E times area over length
    length_mm: float

    def __call__(self, compression_mm: Array) -> tuple[Array, Array]:
        """Return force (N) and tangent (N/mm)."""
        third = self.stiffness / 3.0
        inverse = compression_mm * (-1.0 / self.length_mm)
        inverse += 1.0
        inverse = 1.0 / np.maximum(inverse, LEAST_STRETCH)
        square = inverse * inverse
        # lambda^-2 - lambda = (1 - lambda) (lambda^-2 + lambda^-1 + 1): nothing cancels.
        force = square + inverse
        force += 1.0
        force *= compression_mm
        force *= third
        tangent = square * inverse
        tangent *= 2.0 * third
        tangent += third
        return force, tangent
