"""Reading a touch among 10 ... 100,000 registered faces: time, memory, right answers.

    python tests/bench/recognizer_scale.py [--faces 12 1000 10000 100000] [--touches 40]

Faces of 60 x 60 mm, 64 symbols each, fill a 4095 x 4097 array without gaps. They are put into
the reader's memory as `open_lab` leaves them; what a database takes to give them is measured by
`database_scale.py`. Process time, median; memory is the peak of a process of its own.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import resource
import time
from collections import Counter

for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")

import numpy as np  # noqa: E402
from sqlalchemy import create_engine  # noqa: E402

from generator.alphabet import SymbolStyle, alphabet_named  # noqa: E402
from generator.array import next_larger, profile  # noqa: E402
from probe.contact.contract import Touch  # noqa: E402
from probe.sensor import SensorType  # noqa: E402
from probe.simulate.world.levels import TYPICAL  # noqa: E402
from probe.simulate.world.reading import read_sensor  # noqa: E402
from probe.surface.face import FaceSurface  # noqa: E402
from probe.surface.lattice import LatticeSurface, list_lookup  # noqa: E402
from probe.surface.polygon import polygon  # noqa: E402
from probe.surface.symbols import Relief, emboss  # noqa: E402
from probe.surface.template import template  # noqa: E402
from recognizer.touch.lab import EmbossedArray, EncodedFace, Lab, cell_keys  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.recognise import recognise  # noqa: E402
from recognizer.touch.signal import signal_of  # noqa: E402

SIDE = 8  # symbols along an edge
STYLE = SymbolStyle()
ALPHABET = alphabet_named("dense-4")
SQUARE = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
R, C = (index.ravel() for index in np.mgrid[:SIDE, :SIDE])
CENTRES = np.column_stack([(C + 0.5) * 7.0 + 2.0, 58.0 - (R + 0.5) * 7.0])


def array_4095():
    known = profile("large")
    while known.array().rows < 4095:
        known = next_larger(known)
    return known.array()


class Faces(dict):
    """All faces, each made when it is asked for."""

    def __init__(self, array, row, column):
        self.made_of = array, row, column

    def __contains__(self, number):
        return True

    def __missing__(self, n):
        array, row, column = self.made_of
        rows, columns = row[n] + R, column[n] + C
        labels = array.symbols(rows, columns)
        name = f"object {n // 6}", f"F{n % 6 + 1}"
        return EncodedFace(*name, np.eye(4), (SQUARE,), 0.0, rows, columns, labels, CENTRES)


def encoding_of(array, faces: int) -> EmbossedArray:
    wide = math.ceil(math.sqrt(faces))
    row, column = (SIDE * part for part in np.divmod(np.arange(faces), wide))
    rows, columns = (row[:, None] + R).ravel(), (column[:, None] + C).ravel()
    labels = np.concatenate(
        [
            array.symbols(r, c)
            for r, c in zip(np.array_split(rows, 64), np.array_split(columns, 64), strict=True)
        ]
    )
    keys = cell_keys(array.columns, rows, columns)
    order = np.argsort(keys)
    owners = np.repeat(np.arange(faces), SIDE * SIDE)[order]
    known = Faces(array, row, column)
    return EmbossedArray(
        array=array, alphabet=ALPHABET, style=STYLE, keys=keys[order],
        owners=np.append(owners, -1).astype(np.int32),
        labels=np.append(labels[order], -1).astype(np.int8), dense=None,
        faces=np.column_stack([np.arange(faces) // 6, np.arange(faces) % 6]),
        names={}, engine=create_engine("sqlite://"), known=known,
    )  # fmt: skip


def measured(faces: int, touches: int) -> str:
    encoding = encoding_of(array_4095(), faces)
    reader = Reader(Lab("", (encoding,)), SensorType())
    start = time.process_time()
    encoding.windows()
    indexed = time.process_time() - start
    rng = np.random.default_rng(1)
    relief = Relief(STYLE.height_mm, STYLE.stroke_mm, STYLE.draft_rad, STYLE.chamfer_mm)
    glyphs = tuple(glyph.strokes for glyph in ALPHABET.glyphs)
    drawn = template(emboss(glyphs, ALPHABET.reach * STYLE.pitch_mm, relief), STYLE.pitch_mm)
    counts, ms = Counter(), []
    for _ in range(touches):
        number = int(rng.integers(faces))
        held = encoding.known[number]
        lattice = LatticeSurface(drawn, list_lookup(R, C, held.labels), 0.0, -2.0, -58.0)
        x, y = rng.uniform(12, 48, 2)
        touch = Touch(x, y, rng.uniform(-math.pi, math.pi), rng.uniform(20, 120))
        image, _ = read_sensor(
            FaceSurface(lattice, polygon([SQUARE])), SensorType(), touch, TYPICAL, rng
        )
        start = time.process_time()
        found = recognise(reader, signal_of(image.astype(float)))
        ms.append(1e3 * (time.process_time() - start))
        right = (found.object, found.face) == (held.object, held.face)
        counts["right" if right else "wrong" if found else "rejected"] += 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return (
        f"{faces:8,d} {indexed:9.2f} {np.median(ms):9.1f} {peak:9.0f} "
        f"{counts['right']:7d} {counts['wrong']:6d} {counts['rejected']:6d}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=int, nargs="+", default=[12, 1000, 10000, 100000])
    parser.add_argument("--touches", type=int, default=40)
    options = parser.parse_args()
    print("   faces   index s  ms/touch   peak MB   right  wrong reject")
    for faces in options.faces:
        with multiprocessing.get_context("spawn").Pool(1) as alone:
            print(alone.apply(measured, (faces, options.touches)), flush=True)


if __name__ == "__main__":
    main()
