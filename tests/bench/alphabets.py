"""How far apart the symbols of an alphabet are felt, beside those of dense-4: one minute.

    python tests/bench/alphabets.py

A symbol's felt image is the share of each tactel that its strokes cover, less the mean (a touch is
pressed with some force, whatever it lies on). The distance of two symbols is the sum of squared
differences over the tactels, averaged over places under the tactels and turns; likelihoods of
symbols part by it over twice the noise's variance. Shown as a share of the least distance within
dense-4: 1.0 is told apart as well as its worst pair. Subsets are the best (largest least distance,
then mean) among all glyphs of the alphabets that ship.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from generator.alphabet import ALPHABETS
from generator.alphabet.strokes import Glyph, same_shape, turn_glyph

TACTEL_MM = 1.5875
FINE = 8  # pixels along a tactel
TURNS, PLACES = 12, 4
REACH, STROKE = 0.26, 0.20  # of the pitch: dense-4's


def images(glyph: Glyph, pitch_mm: float) -> NDArray[np.float64]:
    """Return (poses, tactels) of one symbol, the mean of each taken off."""
    side = 2 * int(np.ceil(0.55 * pitch_mm / TACTEL_MM)) + 1
    step = TACTEL_MM / FINE
    line = (np.arange(side * FINE) + 0.5 - side * FINE / 2) * step
    x, y = np.meshgrid(line, -line)
    found = []
    for turn in np.arange(TURNS) * 2 * np.pi / TURNS:
        c, s = np.cos(turn), np.sin(turn)
        for dx in (np.arange(PLACES) + 0.5) / PLACES * TACTEL_MM:
            for dy in (np.arange(PLACES) + 0.5) / PLACES * TACTEL_MM:
                u, v = c * (x - dx) + s * (y - dy), c * (y - dy) - s * (x - dx)
                image = covered(glyph, u / pitch_mm, v / pitch_mm)
                tactels = image.reshape(side, FINE, side, FINE).mean(axis=(1, 3))
                found.append((tactels - tactels.mean()).ravel())
    return np.array(found)


def covered(glyph: Glyph, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points (pitches) lie under the strokes."""
    inside = np.zeros(u.shape, dtype=bool)
    for a, b in glyph.strokes:
        ax, ay = REACH * a[0], REACH * a[1]
        ex, ey = REACH * b[0] - ax, REACH * b[1] - ay
        along = np.clip(((u - ax) * ex + (v - ay) * ey) / (ex * ex + ey * ey), 0, 1)
        inside |= np.hypot(u - ax - along * ex, v - ay - along * ey) <= STROKE / 2
    return inside


def distinct_glyphs() -> list[tuple[str, Glyph]]:
    """Return the glyphs that ship, each shape once, whatever its turn."""
    found: list[tuple[str, Glyph]] = []
    for alphabet in ALPHABETS.values():
        for glyph in alphabet.glyphs:
            turned = [turn_glyph(glyph, quarter) for quarter in range(4)]
            if not any(same_shape(one, known) for _, known in found for one in turned):
                found.append((f"{alphabet.name} {glyph.name}", glyph))
    return found


def distances(glyphs: list[Glyph], pitch_mm: float) -> NDArray[np.float64]:
    felt = np.array([images(glyph, pitch_mm) for glyph in glyphs])
    return np.array([[((a - b) ** 2).sum(axis=1).mean() for b in felt] for a in felt])


def of_pairs(apart: NDArray[np.float64], chosen: tuple[int, ...]) -> NDArray[np.float64]:
    return np.array([apart[a, b] for a, b in combinations(chosen, 2)])


def main() -> None:
    every = distinct_glyphs()
    print("| pitch | alphabet | symbols | bits | least | mean | noise that it may have |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for pitch in (7.0, 4.5):
        apart = distances([glyph for _, glyph in every], pitch)
        shipped = {
            name: distances(list(ALPHABETS[name].glyphs), pitch) for name in ("dense-4", "dense-8")
        }
        unit = of_pairs(shipped["dense-4"], (0, 1, 2, 3)).min()
        rows = [
            (name, len(one), of_pairs(one, tuple(range(len(one))))) for name, one in shipped.items()
        ]
        for number in (4, 5, 7, 8):
            choices = combinations(range(len(every)), number)
            best = max(choices, key=lambda c: (of_pairs(apart, c).min(), of_pairs(apart, c).mean()))
            rows.append(
                (
                    f"best {number}: " + ", ".join(every[k][0] for k in best),
                    number,
                    of_pairs(apart, best),
                )
            )
        for name, number, pairs in rows:
            least = pairs.min() / unit
            print(
                f"| {pitch:g} mm | {name} | {number} | {np.log2(number):.2f} | {least:.2f} | "
                f"{pairs.mean() / unit:.2f} | {np.sqrt(least):.2f} |", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
