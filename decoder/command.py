"""`decode-window ROWS`: where on the array a window lies.

Results go to stdout, messages to stderr. Exit codes: 0 decoded, 1 not decoded (ambiguous, too
few symbols, no such window) or not written, 2 bad input, 4 database, 130 interrupted. The
array comes from a profile, from its definition, or from a lab's database, which also tells
where windows can lie and which object and face an answer belongs to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

from encoded_objects.base import console, output
from encoded_objects.base.errors import UsageError
from encoded_objects.base.foreign import foreign_json, parse_json
from encoded_objects.base.options import Application, Argument, Option, command

if TYPE_CHECKING:
    from decoder.decoded import Decoded
    from decoder.registered import Registered
    from generator.array import FoldedArray, ProductArray
    from generator.array.contract import Labels

HELP = """Find the place of a window on its array.

ROWS are the symbols, rows apart by spaces, ? where none is seen: [bold]decode-window "01 11 \
01 01 00 01" --profile thesis[/]. Symbols of GF(q) are 0, 1, 2 (=A), 3 (=A^2), ...; \
above 9 with commas between, 0,11 3,?.
"""
EPILOG = "Exit codes: 0 decoded, 1 not decoded, 2 bad input, 4 database, 130 interrupted."
NAME = "decode-window"

app = Application()


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run `decode-window` and leave with its exit code."""
    console.main(NAME, lambda _: app, arguments)


def run(arguments: list[str]) -> int:
    """Run the command; returns its exit code. Errors are reported, not raised."""
    return console.run(NAME, lambda _: app, arguments)


@command(app, help=HELP, epilog=EPILOG)
def decode(
    rows: Annotated[list[str], Argument("The window.", "ROWS")],
    profile: Annotated[
        str, Option("A profile's name, as one-touch (by default), thesis, large, tactel-16.")
    ] = "",
    array: Annotated[
        str,
        Option("An array's definition, as JSON or as a file, in place of a profile.", "JSON"),
    ] = "",
    database: Annotated[
        str,
        Option("A lab's database: its array, the registered cells as prior, and the object and "
               "face of the answer.", "URL"),
    ] = "",
    lab_key: Annotated[
        str,
        Option("Whose array of the profile; without it the published one, or the database's own.",
               "KEY"),
    ] = "",
    method: Annotated[
        str, Option("table, serial, milestones, logarithm, likelihood.")
    ] = "logarithm",
    error: Annotated[float, Option("likelihood: how often a symbol is wrong.")] = 0.05,
    doubt: Annotated[
        float, Option("likelihood: largest probability of a wrong answer.")
    ] = 5e-4,
    blank: Annotated[
        float, Option("likelihood: probability that there is no code.")
    ] = 0.01,
    rotations: Annotated[
        str,
        Option("likelihood: quarter turns that may bring the window upright, with commas between.",
               "LIST"),
    ] = "0",
    top: Annotated[int, Option("List the K best candidates.", least=0)] = 0,
    plot: Annotated[Path | None, Option("Draw the window on the array.", "PNG")] = None,
    as_json: Annotated[bool, Option("One JSON object on stdout.", names=("--json",))] = False,
) -> int:  # fmt: skip
    """Decode one window; `HELP` is what people see."""
    from decoder.any_method import METHODS, decode_on
    from decoder.window import parse_window

    if method not in METHODS:
        raise UsageError(f"unknown method '{method}'; choose one of {', '.join(METHODS)}")
    held: Registered | None = None
    if database:
        from decoder.registered import read_registered

        if array:
            raise UsageError("both --array and --database were given; give one of them")
        held = read_registered(database, profile, lab_key)
    chosen = held.array if held else _array(profile, array, lab_key)
    window = parse_window(" ".join(rows), chosen.order)
    found = decode_on(
        chosen, window, method, held,
        rotations=_turns(rotations), error=error, doubt=doubt, blank=blank, top=top,
    )  # fmt: skip
    known = _answer_values(chosen, window, found, method, top)
    if held:
        known |= {"object": found.object, "face": found.face}
    if plot is not None:
        from decoder.view import draw

        draw(chosen, window, found, plot)
        known["plot"] = str(plot)
    _print(known, found, as_json=as_json)
    return console.DONE if found else console.FAILED


def _array(profile_name: str, definition: str, lab_key: str) -> FoldedArray | ProductArray:
    from decoder.any_method import array_of_profile
    from generator.array import array_from

    if not definition:
        return array_of_profile(profile_name, lab_key)
    if profile_name or lab_key:
        given = "--profile" if profile_name else "--lab-key"
        raise UsageError(f"both {given} and --array were given; give one of them")

    def refuse(cause: str, *, place: str = "", **_: str) -> UsageError:
        return UsageError(" ".join(filter(None, ["--array", place, cause])))

    if definition.lstrip().startswith("{"):
        values = parse_json(definition, refuse)
    else:
        values = foreign_json(definition, refuse, fix="")
    if not isinstance(values, dict):
        raise UsageError('--array must be a JSON object, as {"family": "prba", ...}')
    return array_from(values)


def _turns(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise UsageError(f"--rotations {text}: give quarter turns as 0,1,2,3") from None


def _answer_values(
    array: FoldedArray | ProductArray, window: Labels, found: Decoded, method: str, top: int
) -> dict[str, Any]:
    import numpy as np

    from decoder.view import strength
    from generator.array import ArrayError

    cells = np.nonzero(window >= 0)
    seen: dict[str, Any] = {
        "cells": int(cells[0].size),
        "rank": array.rank(*cells) if cells[0].size else 0,
        "full_rank": array.full_rank,
        "errors_corrected": None,
        "erasures_corrected": None,
    }
    try:
        if cells[0].size:
            able = strength(array, *cells)
            seen |= {"errors_corrected": able.errors, "erasures_corrected": able.erasures}
    except ArrayError:
        pass  # out of reach for a view and an array so large: stays unknown
    return {
        "row": found.row,
        "column": found.column,
        "t": found.t,
        "margin": found.margin,
        "doubt": found.doubt,
        "rotation": found.rotation,
        "reason": found.reason,
        "runner_up": found.runner_up and asdict(found.runner_up),
        "candidates": [asdict(place) for place in found.candidates[: top or None]],
        "method": method,
        "array": {"rows": array.rows, "columns": array.columns, "symbols": array.order},
        "seen": seen,
    }


def _print(known: dict[str, Any], found: Decoded, *, as_json: bool) -> None:
    if as_json:
        output.write_json(known, line=True)
        return
    output.write(str(found))
    if found.object:
        output.write(f"{found.object}, face {found.face}")
    elif found and "object" in known:
        output.write("no object is registered there")
    if found.doubt is not None:
        margin = "none" if found.margin is None else f"{found.margin:.1f} nats"
        output.write(f"margin {margin}, doubt {found.doubt:.2g}")
    seen = known["seen"]
    line = f"{seen['cells']} symbols seen, rank {seen['rank']} of {seen['full_rank']}"
    if seen["errors_corrected"] is not None:
        wrong, missing = seen["errors_corrected"], seen["erasures_corrected"]
        line += f"; always corrects {wrong} wrong or {missing} missing"
    output.write(line)
    for place in known["candidates"]:
        score = "" if place["score"] is None else f"  {place['score']:9.3f} nats"
        turn = f"  turned {90 * place['rotation']}" if place["rotation"] else ""
        output.write(f"  row {place['row']}, column {place['column']}{score}{turn}")
