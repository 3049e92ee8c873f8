"""Reading a touch among 10 ... 1,000,000 registered faces: time, memory, doubt, right answers.

    python tests/bench/recognizer_scale.py [--faces 10 1000 100000 1000000] [--touches 40]

Faces of 60 x 60 mm, 121 symbols of 5 mm each as `auto` lays them, fill the smallest of `large` and
its next sizes that holds them, without gaps. They are put into the reader's memory as `open_lab`
leaves them; what a database takes to give them is measured by `database_scale.py`. Touches amid
faces, typical. Process time, median; memory is the peak of a process of its own. 1,000,000 faces
take 8 GB.
"""

import math
import multiprocessing
import resource
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from sqlalchemy import create_engine

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from generator.array import next_larger, profile
from probe.contact.contract import Touch
from probe.simulate.scene import Scene
from probe.simulate.world.levels import TYPICAL
from probe.simulate.world.sensor import LevelSensor
from probe.surface.face import FaceSurface, LatticeSurface, list_lookup, template
from probe.surface.polygon import polygon
from probe.surface.symbols import Relief, emboss
from recognizer.touch.lab import EmbossedArray, EncodedFace, Lab, cell_keys
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.signal import signal_of

SIDE = 11  # symbols along an edge
STYLE = SymbolStyle(pitch_mm=5.0, stroke_mm=1.0, draft_rad=math.radians(5.0))
ALPHABET = alphabet_named("dense-4")
SQUARE = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 60.0], [0.0, 60.0]])
R, C = (index.ravel() for index in np.mgrid[:SIDE, :SIDE])
CENTRES = np.column_stack([(C + 0.5) * 5.0 + 2.5, 57.5 - (R + 0.5) * 5.0])


def array_for(faces: int):
    """Return the smallest array in whose rows and columns the faces lie side by side."""
    known = profile("large")
    while (array := known.array()).rows // SIDE * (array.columns // SIDE) < faces:
        known = next_larger(known)
    return array


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
    wide = array.columns // SIDE
    row, column = (SIDE * part for part in np.divmod(np.arange(faces), wide))
    rows, columns = (row[:, None] + R).ravel(), (column[:, None] + C).ravel()
    parts = zip(np.array_split(rows, 64), np.array_split(columns, 64), strict=True)
    labels = np.concatenate([array.symbols(r, c) for r, c in parts])
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


def measured(faces: int, touches: int) -> tuple[object, ...]:
    """Return the line of so many faces."""
    array = array_for(faces)
    encoding = encoding_of(array, faces)
    reader = Reader(Lab("", (encoding,)), SensorType())
    start = time.process_time()
    _ = encoding.windows  # indexed when it is asked for first
    indexed = time.process_time() - start
    rng = np.random.default_rng(1)
    relief = Relief(STYLE.height_mm, STYLE.stroke_mm, STYLE.draft_rad, STYLE.chamfer_mm)
    glyphs = tuple(glyph.strokes for glyph in ALPHABET.glyphs)
    drawn = template(emboss(glyphs, ALPHABET.reach * STYLE.pitch_mm, relief), STYLE.pitch_mm)
    counts, ms, doubts = Counter(), [], []
    for _ in range(touches):
        number = int(rng.integers(faces))
        held = encoding.known[number]
        lattice = LatticeSurface(drawn, list_lookup(R, C, held.labels), 0.0, -2.5, -57.5)
        x, y = rng.uniform(12, 48, 2)
        touch = Touch(x, y, rng.uniform(-math.pi, math.pi), rng.uniform(20, 120))
        region = polygon([SQUARE])
        scene = Scene(FaceSurface(lattice, region), region, "")
        image = LevelSensor(SensorType(), TYPICAL).read(scene, touch, rng).counts
        start = time.process_time()
        found = recognise(reader, signal_of(image.astype(float)))
        ms.append(1e3 * (time.process_time() - start))
        doubts += [] if found.doubt is None else [found.doubt]
        right = (found.object, found.face) == (held.object, held.face)
        counts["right" if right else "wrong" if found else "rejected"] += 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    doubt = np.median(doubts) if doubts else math.nan
    verdicts = (counts[name] for name in ("right", "wrong", "rejected"))
    return (f"{faces:,}", f"{array.rows}x{array.columns}", indexed, float(np.median(ms)), peak,
            f"{doubt:.1e}", *verdicts)  # fmt: skip


def main() -> None:
    """Print a line for each number of faces."""
    asked = runner.asked(__doc__, touches=40, faces=[10, 1000, 100000, 1000000])
    runner.table(("faces", "array", "index, s", "ms a touch", "peak MB", "doubt", "right", "wrong",
                  "rejected"))  # fmt: skip
    for faces in asked.faces:
        with multiprocessing.get_context("spawn").Pool(1) as alone:  # whose memory is measured
            runner.row(*alone.apply(measured, (faces, asked.touches)))


if __name__ == "__main__":
    main()
