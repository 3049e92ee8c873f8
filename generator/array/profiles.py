"""Ready choices of array, window, alphabet and pitch, by name.

`one-touch` is the default: its 3x2 window lies under one 25 mm touch. Windows are rows x
columns. `thesis` and `product` are the thesis's experiments (6.17 to 6.19, figure 5.11). Folds and
polynomials of `large`, `fine` and the sizes above them leave a touch the fewest rivals of all that
were tried (docs/folds.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from encoded_objects.base.sensor_type import SensorType
from generator.array.definition import array_from
from generator.array.fold import FoldedArray, nearest_sizes
from generator.array.lab_key import keyed_array
from generator.array.product import ProductArray
from generator.errors import ArrayError

DEFAULT_PROFILE = "one-touch"
SMALLEST = ("tactel-8", "large")
"""Profiles whose arrays, and larger ones, `auto` takes: room for some hundred objects. Letters of
the first are made for tabs that lie close; the second serves other sensors and smaller alphabets
(docs/alphabets.md)."""
LEAST_TACTELS = 3.1  #: to a symbol, from which letters made for tactels were measured


@dataclass(frozen=True, slots=True)
class Profile:
    """One ready choice."""

    name: str
    encoding: Mapping[str, Any]  #: what `array_from` takes; read-only
    window: tuple[int, int]  #: rows, columns
    alphabet: str  #: name of the alphabet
    pitch_mm: float  #: distance of neighbouring symbols
    keyed: bool = False  #: whether every lab has an array of its own; the others are published

    def array(self) -> FoldedArray | ProductArray:
        """Return the array of this profile, without a key."""
        return array_from(self.encoding)

    def array_of_lab(self, lab_key: str) -> FoldedArray | ProductArray:
        """Return a lab's own array; of a profile that has no keys, the published one."""
        published = self.array()
        if not (lab_key and self.keyed) or isinstance(published, ProductArray):
            return published
        return keyed_array(published, lab_key)


def _folded(order: int, degree: int, rows: int, columns: int, **polynomial: str) -> dict[str, Any]:
    field = {"family": "prmva", "order": order, "degree": degree}
    return field | polynomial | {"rows": rows, "columns": columns}


def _gf4(degree: int, polynomial: str, rows: int, columns: int) -> dict[str, Any]:
    return _folded(4, degree, rows, columns, polynomial=polynomial)


_LARGE = _gf4(8, "x^8+x^7+A^2x^4+A^2x^3+x^2+A^2", 51, 1285)

#: Next sizes by order and degree; beyond them the most square folds (`generator.array.definition`).
_LARGER = {
    (order, degree): _folded(order, degree, rows, columns, polynomial=polynomial)
    for order, degree, polynomial, rows, columns in (
        (4, 9, "x^9+A^2x^6+x^2+A", 511, 513),
        (4, 10, "x^10+Ax^9+Ax^8+Ax^7+x^6+A^2x^5+A^2x^4+Ax^3+A^2x^2+Ax+A", 825, 1271),
        (4, 11, "x^11+A^2x^9+Ax^8+x^7+A^2x^6+Ax^5+Ax^4+x^3+A^2x^2+Ax+A^2", 2047, 2049),
        (4, 12, "x^12+A^2x^11+A^2x^10+x^9+Ax^7+x^6+x^5+A^2x^4+Ax^3+A^2x^2+A", 3133, 5355),
        (8, 7, "x^7+A^4x^6+A^3x^4+Ax+A^3", 337, 6223),
        (8, 8, "x^8+A^6x^7+A^4x^6+A^5x^5+A^3x^4+A^5x^3+x+A^2", 3133, 5355),
        (8, 10, "x^10+Ax^2+x+A^2", 25487, 42129),
        (16, 5, "x^5+A^9x^4+A^4x^3+A^2x^2+A^13x+A", 775, 1353),
        (16, 6, "x^6+A^3x^5+A^7x^4+A^9x^3+A^10x^2+A^6x+A^2", 2169, 7735),
        (16, 7, "x^7+A^7x^6+A^5x^5+A^4x^4+A^6x^3+A^5x+A^11", 14351, 18705),
        (32, 4, "x^4+A^22x^3+Ax^2+A^5x+A^21", 825, 1271),
        (32, 5, "x^5+x^2+A^7", 1801, 18631),
        (32, 6, "x^6+A^17x^5+A^7x^4+A^29x^3+A^23x^2+A^23x+A^26", 25487, 42129),
    )
}

_THESIS = {"family": "prba", "polynomial": "0x1099", "rows": 63, "columns": 65}
_PRODUCT = {
    "family": "prmvpa",
    "factors": {
        "rows": {"order": 2, "polynomial": "x^4+x+1"},
        "columns": {"order": 4, "polynomial": "x^2+x+A"},
    },
}

PROFILES: Mapping[str, Profile] = MappingProxyType(
    {
        name: Profile(
            name,
            MappingProxyType(encoding | {"window": list(window)}),
            window,
            alphabet,
            pitch_mm,
            keyed,
        )
        for name, encoding, window, alphabet, pitch_mm, keyed in (
            # one 25 mm touch is enough
            ("one-touch", _gf4(6, "x^6+x^2+x+A", 63, 65), (3, 2), "dense-4", 7.0, True),
            # the thesis's own experiment, its three published windows
            ("thesis", _THESIS, (6, 2), "thesis-2", 12.0, False),
            # the thesis's product array (figure 5.11), indices found apart
            ("product", _PRODUCT, (4, 2), "dense-8", 12.0, False),
            ("large", _LARGE, (4, 2), "dense-4", 7.0, True),  # hundreds of objects
            ("fine", _LARGE, (4, 2), "dense-4", 4.5, True),  # resin printing, small faces
            # three and four bits a symbol, for labs of hundreds of objects
            ("tactel-8", _folded(8, 6, 189, 1387), (3, 2), "tactel-8", 5.0, True),
            ("tactel-16", _folded(16, 4, 51, 1285), (2, 2), "tactel-16", 5.0, True),
        )
    }
)


def profile(name: str = DEFAULT_PROFILE) -> Profile:
    """Return the profile called `name`; raises `ArrayError` that lists the known ones."""
    try:
        return PROFILES[name]
    except KeyError:
        raise ArrayError(
            f"unknown profile '{name}'", fix=f"choose one of {', '.join(PROFILES)}"
        ) from None


def next_larger(smaller: Profile) -> Profile:
    """Return the profile on the next larger array of the same field, its window the smallest one.

    Over GF(4) 511x513, 825x1271, 2047x2049 and 3133x5355, over GF(8) 337x6223, 3133x5355 and
    25487x42129, over GF(16) 775x1353, 2169x7735 and 14351x18705, then the most square folds. Raises
    `ArrayError` for a product array, or if no larger one decodes.
    """
    array = smaller.array()
    if isinstance(array, ProductArray) or array.rows == 1:
        raise ArrayError(
            f"profile '{smaller.name}' is not a folded array, so it has no next size",
            fix="take profile large",
        )
    encoding = _next_encoding(array.order, array.full_rank)
    if encoding is None:
        raise ArrayError(
            f"no array over GF({array.order}) is larger than {array.rows}x{array.columns}",
            fix="start another database",
        )
    larger = array_from({"family": array.family} | encoding)
    return replace(smaller, encoding=MappingProxyType(larger.definition()), window=larger.window)


def _next_encoding(order: int, degree: int) -> dict[str, Any] | None:
    """Return the array of the next degree that decodes on a fold that is no long strip."""
    while above := [size for size in nearest_sizes(order, degree) if size[0] > degree]:
        degree, (rows, columns) = above[0]
        if (order, degree) in _LARGER:
            return _LARGER[order, degree]
        if columns <= 2 * rows:
            return {"order": order, "degree": degree, "rows": rows, "columns": columns}
    return None


def smallest_profile(sensor: SensorType) -> str:
    """Return the profile of `SMALLEST` whose letters a sensor type tells apart."""
    tactels = sensor.symbol_pitch_mm / max(sensor.step_mm)
    apart = sensor.overlay.kind == "tab" and tactels >= LEAST_TACTELS
    return SMALLEST[0] if apart else SMALLEST[-1]


def family_of(profile: str) -> str:
    """Return the one of `SMALLEST` of which a profile is a larger size; else the profile itself.

    Examples
    --------
    >>> family_of("large-511x513"), family_of("tactel-8"), family_of("fine")
    ('large', 'tactel-8', 'fine')
    """
    return next((one for one in SMALLEST if f"{profile}-".startswith(f"{one}-")), profile)
