"""The tables of docs/folds.md: rivals by array, fold and pitch; bits and chance by pitch; times.

    python tests/bench/folds.py            # all tables, as Markdown: one minute
    python tests/bench/folds.py rivals     # or chance, arrays, promise

Symbols reach .36 of the pitch from their centre (dense-4), the sensor is 25.4 mm wide.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from generator.array import FoldedArray, array_from, next_larger, profile
from generator.array.profiles import Profile
from generator.layout.layout import lay_out
from generator.layout.placement import FaceLayout
from generator.layout.recognition_rate import (
    POSES,
    FaceViews,
    SensorView,
    answered_shares,
    face_views,
    measured_answers,
)
from generator.polyhedron import face_polygon, shapes

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.rivals import rival_shares
from reference.visible import visible_sets

PITCHES_MM = (7.0, 6.0, 5.5, 5.0, 4.5)
CHANCE_PITCHES_MM = (4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0)
SENSOR_HALF_MM = (12.7, 12.7)
SYMBOL_SHARE = 0.36  # of the pitch, from a symbol's centre to the end of its strokes
FOOT_MM = 0.09  # that the foot reaches beyond: 1 mm high, 5 degrees of draft
CLEAR_MM = 1.0  # from a foot to the edge of its face
FACE_MM = 60.0
NEAR_MM = 9.0  # edge: the centre within this of one side; corner: of two
FILL = 0.8  # share of an array that faces of all shapes fill
REGISTERED = (10, 1_000, 100_000, 1_000_000)
COMPARED = (  # folds beside those of the profiles: what it is, degree, polynomial, rows, columns
    ("beside it", 6, "x^6+Ax^5+x^4+x^3+A^2x^2+A^2", 45, 91),
    ("`large` before", 8, "x^8+x^3+x+A", 255, 257),
    ("its polynomial", 8, "x^8+x^3+x+A", 51, 1285),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    tables = {"rivals": rivals, "chance": chance, "arrays": arrays, "promise": promise}
    parser.add_argument("table", nargs="*", default=[], help=f"of {', '.join(tables)}")
    for name in parser.parse_args().table or tables:
        print("\n".join(tables[name]()), flush=True)
        print()


def folded(degree: int, polynomial: str, rows: int, columns: int) -> FoldedArray:
    array = array_from(
        {"family": "prmva", "order": 4, "degree": degree, "polynomial": polynomial}
        | {"rows": rows, "columns": columns}
    )
    assert isinstance(array, FoldedArray)
    return array


def sizes(larger_ones: int) -> Iterable[Profile]:
    """Yield the profiles from the smallest array on: one-touch, large and so many above it."""
    yield profile("one-touch")
    larger = profile("large")
    for _ in range(1 + larger_ones):
        yield larger
        larger = next_larger(larger)


def rivals() -> Iterable[str]:
    """Share of poses (%) with a rival: identical / within one / within two symbols.

    In brackets the identical rivals of a pose, mean.
    """
    yield "| array | " + " | ".join(f"{p:g} mm" for p in PITCHES_MM) + " |"
    yield "| --- |" + " --- |" * len(PITCHES_MM)
    shown = [("`one-touch`", profile("one-touch").array())]
    shown += [(name, folded(*one)) for name, *one in COMPARED]
    names = ["`large`, `fine`", "next", "next", "next", "next"]
    shown += zip(names, [one.array() for one in sizes(4)][1:], strict=True)
    for name, array in shown:
        cells = []
        for pitch in PITCHES_MM:
            sets = visible_sets(pitch, SENSOR_HALF_MM, SYMBOL_SHARE * pitch)
            found = rival_shares(array, sets)
            text = " / ".join(percent(share) for share in found.poses)
            same = found.rivals[0]
            cells.append(text + (f" ({same:.3g})" if same > 0.005 else ""))
        yield f"| {array.rows}x{array.columns} {name} | " + " | ".join(cells) + " |"


def percent(share: float) -> str:
    if share in (0.0, 1.0) or share > 0.9995:
        return f"{100 * share:.0f}"
    return f"{100 * share:.0f}" if share >= 0.095 else f"{100 * share:.2g}".replace("0.", ".", 1)


def chance() -> Iterable[str]:
    """Bits of a touch by pitch, and how many registered places a foreign one matches."""
    yield (
        "| pitch | cells of a 60 mm face | bits: face | edge | corner | "
        + " | ".join(f"{n:,} faces" for n in REGISTERED) + " |"
    )  # fmt: skip
    yield "| --- |" * 1 + " --- |" * (4 + len(REGISTERED))
    for pitch in CHANCE_PITCHES_MM:
        face, views = square_face(pitch, 20_000)
        near = (np.minimum(views.centre_mm, FACE_MM - views.centre_mm) < NEAR_MM).sum(axis=1)
        bits = [2 * views.seen[near == sides] for sides in range(3)]
        columns = [f"{one.mean():.0f}, {np.percentile(one, 10):.0f}" for one in bits]
        for registered in REGISTERED:
            places = registered * len(face.labels)
            by_chance = [np.mean(np.minimum(places * 2.0**-one, 1.0)) for one in bits]
            columns.append(" / ".join(f"{x:.0e}" if x < 0.095 else f"{x:.1f}" for x in by_chance))
        yield f"| {pitch:g} mm | {len(face.labels)} | " + " | ".join(columns) + " |"


def arrays() -> Iterable[str]:
    """The smallest array that holds so many faces of 60 mm, by pitch."""
    yield "| pitch | " + " | ".join(f"{n:,} faces" for n in REGISTERED) + " |"
    yield "| --- |" + " --- |" * len(REGISTERED)
    known = [one.array() for one in sizes(6)]
    for pitch in CHANCE_PITCHES_MM:
        face, _ = square_face(pitch, 10)
        columns = []
        for registered in REGISTERED:
            needed = registered * len(face.labels) / FILL
            fits = (a for a in known if a.rows * a.columns >= needed)
            chosen = next(fits, None)
            columns.append("-" if chosen is None else f"{chosen.rows}x{chosen.columns}")
        yield f"| {pitch:g} mm | " + " | ".join(columns) + " |"


def promise() -> Iterable[str]:
    """What a 60 mm face shows, and what it takes to know that of a cube's six."""
    yield "| pitch | seen whole | loaded | answered at once | six faces |"
    yield "| --- | --- | --- | --- | --- |"
    for pitch in CHANCE_PITCHES_MM:
        square_face(pitch, POSES)
        start = time.process_time()
        for _ in range(6):
            _, views = square_face(pitch, POSES, laid=True)
            share, _ = answered_shares(views, measured_answers(), pitch)
        spent = time.process_time() - start
        yield (
            f"| {pitch:g} mm | {views.seen.mean():.1f} | {views.loaded.mean():.2f} | "
            f"{share:.2f} | {1000 * spent:.0f} ms |"
        )


_laid: dict[float, FaceLayout] = {}
_array = profile("large").array()
_solid = shapes.cube(FACE_MM)


def square_face(pitch_mm: float, poses: int, *, laid: bool = False) -> tuple[FaceLayout, FaceViews]:
    """Return a face of a 60 mm cube on the array of `large`, and what a sensor meets there."""
    if not laid:
        none = np.empty(0, dtype=np.int64)
        half = SYMBOL_SHARE * pitch_mm + FOOT_MM
        clearances = [[np.full(len(loop), CLEAR_MM) for loop in f.loops] for f in _solid.faces]
        _laid[pitch_mm] = lay_out(
            _solid, _array, pitch_mm, half, clearances, (none, none), kind="faces"
        ).faces[0]
    face = _laid[pitch_mm]
    view = SensorView(SENSOR_HALF_MM, SYMBOL_SHARE * pitch_mm)
    loops = face_polygon(_solid, face.face)
    views = face_views(loops, face, pitch_mm, view, poses)
    return face, views


if __name__ == "__main__":
    main()
