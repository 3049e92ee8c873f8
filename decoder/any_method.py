"""One window -> where it lies, by any method, on the array of a profile or of a lab.

The command and scripts decode by this; batches go to `decode_exact` and `decode_likelihood`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from decoder.decoded import Decoded
from decoder.errors import DecoderError, MethodError
from decoder.exact import decode_exact
from decoder.likelihood import BLANK, DOUBT, decode_likelihood
from decoder.window import SYMBOL_ERROR, parse_window
from generator.array import DEFAULT_PROFILE, FoldedArray, ProductArray, array_from
from generator.array import profile as profile_named
from generator.array.lab_key import read_lab_key

if TYPE_CHECKING:
    from decoder.registered import Registered

METHODS = ("table", "serial", "milestones", "logarithm", "likelihood")


def decode(
    window: str | ArrayLike,
    *,
    profile: str = "",
    array: FoldedArray | ProductArray | Mapping[str, Any] | None = None,
    database: str = "",
    lab_key: str = "",
    method: str = "logarithm",
    error: float = SYMBOL_ERROR,
    doubt: float = DOUBT,
    blank: float = BLANK,
    rotations: Sequence[int] = (0,),
    top: int = 0,
) -> Decoded:
    """Find the place of a window on its array.

    Parameters
    ----------
    window
        Rows apart by spaces, ? where no symbol is seen: "01 11 0? 01"; or labels
        (rows, columns), -1 where none is seen.
    profile
        A profile's name; one-touch if nothing is said.
    array
        In place of a profile: an array, or its definition, as {"family": "prba", ...}.
    database
        In place of both, a lab's: its array, the registered cells as prior, and the object
        and face of the answer; `profile` says which array where it holds several.
    lab_key
        Whose array of the profile, or of the arrays in the database; without a key the published
        one, and the database's own.
    method
        table, serial, milestones, logarithm, or likelihood.
    error, doubt, blank, rotations, top
        Of likelihood: see `decode_likelihood`.

    Raises
    ------
    DecoderError, ArrayError
        No such array or method, or no window of its symbols.

    Examples
    --------
    The right half of the thesis's figure 5.2:

    >>> found = decode("01 11 01 01 00 01", profile="thesis")
    >>> print(found)
    row 1, column 61 (t = 2206)
    >>> print(decode("0? ?? ?? ?? ?? ??", profile="thesis"))
    not decoded: too few symbols
    """
    held: Registered | None = None
    if database:
        from decoder.registered import read_registered

        if array is not None:
            raise DecoderError("both an array and a database were given", fix="give one of them")
        held = read_registered(database, profile, lab_key)
    if array is not None and profile:
        raise DecoderError("both an array and a profile were given", fix="give one of them")
    if held:
        on = held.array
    elif array is None:
        on = array_of_profile(profile, lab_key)
    else:
        on = array_from(array) if isinstance(array, Mapping) else array
    labels = parse_window(window, on.order) if isinstance(window, str) else np.asarray(window)
    return decode_on(
        on, labels, method, held,
        error=error, doubt=doubt, blank=blank, rotations=rotations, top=top,
    )  # fmt: skip


def array_of_profile(profile: str = "", lab_key: str = "") -> FoldedArray | ProductArray:
    """Return a lab's array of a profile; without a key the published one.

    Raises `ArrayError` or `LabKeyError` for no such profile or key, `DecoderError` for a key and a
    profile that is the same in every lab.
    """
    named = profile_named(profile or DEFAULT_PROFILE)
    if lab_key and not named.keyed:
        cause = f"profile {named.name} is the same array in every lab"
        raise DecoderError(cause, fix="leave the lab key out")
    return named.array_of_lab(read_lab_key(lab_key) if lab_key else "")


def decode_on(
    array: FoldedArray | ProductArray,
    window: ArrayLike,
    method: str,
    held: Registered | None = None,
    **likelihood: Any,
) -> Decoded:
    """Return the place of one window (rows, columns), with whose it is if a lab holds it.

    `likelihood` are parameters of `decode_likelihood`; the other methods have none. Raises
    `MethodError` for no such method, or one that does not serve this array.
    """
    if method not in METHODS:
        raise MethodError(f"unknown method '{method}'", fix=f"choose one of {', '.join(METHODS)}")
    if method != "likelihood":
        found = decode_exact(array, window, method)[0]
    else:
        places = None
        if held:
            from decoder.registered import prior

            places = prior(held, np.asarray(window))
        found = decode_likelihood(array, window, prior=places, **likelihood)[0]
    if held and found.row is not None and found.column is not None:
        from decoder.registered import holder

        names = holder(held, found.row, found.column)
        return replace(found, object=names[0], face=names[1]) if names else found
    return found
