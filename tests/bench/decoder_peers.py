"""Against the peers that can be installed: same number of cells, same damage, one run.

    python -m venv peers && peers/bin/pip install numpy pillow calib-targets==0.15.5
    PYTHONPATH=. peers/bin/python tests/bench/decoder_peers.py --seed 1

calib-targets decodes PuzzleBoard (501x501, binary, four rotations, soft likelihood and a
margin gate). A board of 8x8 squares is drawn at random places of it; dots are inverted with
the error rate, and painted grey where they are missing. It reads 60 of the dots (30 different
bits: its pattern repeats), with its default margin gate and with the gate open. Our view has
60 cells (6x10) of a 511x513 array, four rotations allowed, hard symbols, default reject
threshold, once with the exact transform and once among 400 registered places. Its time is
that of the whole detection; the second time column leaves out what an undamaged image costs
without decoding (chessboard detection alone). Right, wrong, rejected in percent.

PuzzleBoard's own decoder and py-microdots (Anoto) are not on the Python package index, so
they are not in this run.
"""

from __future__ import annotations

import dataclasses
import io
import sys
import time
from pathlib import Path

import numpy as np

from decoder import Likelihood
from generator.array import array_from

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

DAMAGE = ((0.0, 0.0), (0.02, 0.0), (0.05, 0.0), (0.10, 0.0), (0.20, 0.0), (0.0, 0.2), (0.0, 0.4))
SQUARES, SQUARE_MM, MARGIN_MM, DPI = 8, 10.0, 15.0, 150
SCALE = DPI / 25.4


def main() -> None:
    """Print a line for each decoder and damage; times in ms."""
    options = runner.asked(__doc__, seed=1, boards=150, windows=1000)
    runner.table(("decoder", "wrong", "missing", "right", "wrong", "reject", "ms", "decode"))
    for damage in DAMAGE:
        rng = np.random.default_rng([options.seed, int(100 * damage[0]), int(100 * damage[1])])
        for name, margin in (("calib-targets PuzzleBoard", None), ("  the same, gate open", 0.0)):
            runner.row(name, *damage, *puzzleboard(damage, options.boards, rng, margin))
        for name, registered in (("ours, all places", False), ("ours, 400 registered", True)):
            runner.row(name, *damage, *ours(damage, options.windows, rng, registered))


def ours(damage, number: int, rng, registered: bool):
    array = array_from({"family": "prba", "order": 2, "degree": 18})
    prior = np.stack([rng.integers(0, array.rows, 400), rng.integers(0, array.columns, 400)], 1)
    places = np.stack([rng.integers(0, array.rows, number),
                       rng.integers(0, array.columns, number)], axis=1)  # fmt: skip
    if registered:
        places = prior[rng.integers(0, 400, number)]
    a, b = np.indices((6, 10))
    read = array.symbols(places[:, 0, None, None] + a, places[:, 1, None, None] + b)
    read = read ^ (rng.random(read.shape) < damage[0])
    read = np.where(rng.random(read.shape) < damage[1], -1, read)
    decoder = Likelihood(array, rotations=(0, 1, 2, 3), prior=prior if registered else None)
    decoder.decode(read[:1])
    found, spent = runner.clocked(decoder.decode, read)
    right = (found.rows == places[:, 0]) & (found.columns == places[:, 1])
    right &= found.rotations == 0
    given = found.answered
    return (
        *(100 * x.mean() for x in (right & given, ~right & given, ~given)),
        *2 * [spent / number],
    )


def puzzleboard(damage, number: int, rng, margin: float | None):
    import calib_targets

    params = calib_targets.default_puzzleboard_params(SQUARES, SQUARES)
    if margin is not None:
        gate = dataclasses.replace(
            params.decode, alignment_min_margin=margin, max_bit_error_rate=0.5
        )
        params = dataclasses.replace(params, decode=gate)
    outcomes = {"right": 0, "wrong": 0, "rejected": 0}
    spent = without = 0.0
    for _ in range(number):
        row, column = (int(x) for x in rng.integers(0, 501 - SQUARES, 2))
        image = damaged(drawn(row, column), damage, rng)
        start = time.process_time()
        try:
            found = calib_targets.detect_puzzleboard(image, params=params)
        except (RuntimeError, ValueError):
            found = None
        spent += time.process_time() - start
        outcomes[judged(found, row, column)] += 1
        start = time.process_time()
        calib_targets.detect_chessboard(image, params=params.chessboard)
        without += time.process_time() - start
    shares = [100 * outcomes[name] / number for name in ("right", "wrong", "rejected")]
    return (*shares, spent / number * 1e3, (spent - without) / number * 1e3)


def judged(found, row: int, column: int) -> str:
    if found is None or not found.corners:
        return "rejected"
    for corner in found.corners:
        x, y = ((p / SCALE - MARGIN_MM) / SQUARE_MM for p in corner.position)
        if (corner.grid.u - column - round(x)) % 501 or (corner.grid.v - row - round(y)) % 501:
            return "wrong"
    return "right"


def drawn(row: int, column: int) -> np.ndarray:
    import calib_targets
    from PIL import Image

    size = SQUARES * SQUARE_MM + 2 * MARGIN_MM
    document = calib_targets.puzzleboard_document(
        SQUARES, SQUARES, SQUARE_MM, origin_row=row, origin_col=column,
        page=calib_targets.PageSpec(size=calib_targets.PageSize(
            kind="custom", width_mm=size, height_mm=size)),
        render=calib_targets.RenderOptions(png_dpi=DPI),
    )  # fmt: skip
    png = calib_targets.render_target_bundle(document).png_bytes
    return np.array(Image.open(io.BytesIO(bytes(png))).convert("L"))


def damaged(image: np.ndarray, damage, rng) -> np.ndarray:
    """Invert or grey the dots, one in the middle of every edge between two squares."""
    y, x = np.indices(image.shape)
    for i in range(1, SQUARES):
        for j in range(SQUARES):
            for across, down in ((i, j + 0.5), (j + 0.5, i)):
                wrong, missing = rng.random() < damage[0], rng.random() < damage[1]
                if not (wrong or missing):
                    continue
                centre = [(MARGIN_MM + SQUARE_MM * place) * SCALE for place in (across, down)]
                value = 128 if missing else 255 - image[int(centre[1]), int(centre[0])]
                radius = SQUARE_MM / 6 * SCALE + 0.5
                disc = (x - centre[0]) ** 2 + (y - centre[1]) ** 2 <= radius**2
                image[disc] = value
    return image


if __name__ == "__main__":
    main()
