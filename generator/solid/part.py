"""The intermediate solid: vertices, planar facets with loops, and what stands on them.

A part is a plain polyhedral body plus embossings. An embossing repeats a few symbol
outlines (tiers) many times on one facet, so a part with 20,000 symbols stays as small
as its list of centres; exporters instance each outline instead of repeating geometry.
Part frame: mm, local origin, as the part lies on the printer's bed (z up); its box is
centred on x and y and stands on z = 0.

A point q of a symbol (its own axes, mm) lies at T_part_facet (R q + centre, z) with R the
turn by rotation_rad and z the tier's height; `Tiers` tells how its loops run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.solid.analytic import AnalyticFace


@dataclass(frozen=True, slots=True)
class Facet:
    """A planar polygon of the body, before its embossing is cut in."""

    name: str
    loops: tuple[tuple[int, ...], ...]  #: body vertices; outer counter-clockwise seen from outside


@dataclass(frozen=True, slots=True)
class Embossing:
    """Symbols on one facet; tiers with falling z are engraved instead."""

    facet: int  #: number of the facet in the part
    face: int | None  #: face of the object, None for marks such as edge numbers
    T_part_facet: NDArray[np.float64]  #: (4, 4); z outward, the facet lies in z = 0
    rotation_rad: float  #: of the symbols' x axis in the facet frame
    centres_mm: NDArray[np.float64]  #: (n, 2) facet frame
    labels: NDArray[np.int64]  #: (n,) which outline of `tiers`
    names: tuple[str, ...]  #: (n,) name of each symbol, "r12c34"
    tiers: tuple[Tiers, ...]  #: one per label, in the symbol's own axes
    pitch_mm: float = 0.0  #: of the lattice that all centres lie on; 0 where there is none


@dataclass(frozen=True, slots=True)
class WrappedSymbols:
    """Symbols on a round face: not instanced, each bends over the facets under it.

    Their sides and tops are facets of the part like any other; here stands which ones.
    """

    face: int  #: face of the object
    facets: tuple[int, ...]  #: of the part that carry them
    first: int  #: facet of the part with which the symbols' own facets begin
    symbols: NDArray[np.int64]  #: (m,) symbol that each of the facets from `first` on belongs to
    labels: NDArray[np.int64]  #: (n,)
    names: tuple[str, ...]  #: (n,) name of each symbol, "r12c34"
    feet: tuple[Facet, ...]  #: what the symbols cut out of the facets that carry them


@dataclass(frozen=True, slots=True)
class Part:
    """One printable body."""

    name: str
    vertices: NDArray[np.float64]  #: (V, 3) mm, part frame; the body alone
    facets: tuple[Facet, ...]
    embossings: tuple[Embossing, ...]
    T_object_part: NDArray[np.float64]  #: (4, 4)
    wrapped: tuple[WrappedSymbols, ...] = ()
    analytic: tuple[AnalyticFace, ...] = ()  #: what some of the facets stand for

    @property
    def symbols(self) -> int:
        """Number of symbols; marks such as edge numbers do not count."""
        flat = sum(len(e.labels) for e in self.embossings if e.face is not None)
        return flat + sum(len(w.labels) for w in self.wrapped)
