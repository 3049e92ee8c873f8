"""The washer of the thesis's figures 4.9 and 4.10: tab overlay against one-piece pad.

    OPENBLAS_NUM_THREADS=1 python tests/bench/washer.py --png docs/washer.png

A washer of 15/7 mm pressed with 80 N on the two overlays of 2 mm, read by the default board
and median filtered over 3x3 as in the thesis. One line per overlay: forces as the contact
model gives them, readings as the board does (`--frames` averaged), and readings filtered.

beside   share of the image on tactels that the ring does not cover at all
hole     mean over the tactels wholly in the hole, over the mean of those wholly on the ring
blur     deviation, mm, of the Gaussian that makes the ring most like the image
match    correlation with the ring's cover of each tactel: 1 where nothing is blurred

The picture shows the first frame of each, filtered, from above and as a surface.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.circuit import Electronics, fsr_of
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.frame import median_filter
from probe.plot.frame import frames_picture
from probe.surface.indenters import Washer

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.drawn_fsr import read_sequence

FORCE_N = 80.0
FINEST = {"tab": "tabs-61", "pad": "layer-8"}
FINE = 16  # samples of a tactel each way, for its cover


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=220)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--png", type=Path)
    options = parser.parse_args()
    step_mm = SensorType().pitch_mm / FINE
    blurred = {round(sigma, 2): tactels(gaussian_filter(ring(), sigma / step_mm))
               for sigma in np.arange(0, 3, 0.05)}  # fmt: skip
    print(f"{'overlay':<9}{'image':<11}{'beside %':>9}{'hole %':>8}{'blur mm':>9}{'match':>8}")
    pictures = {}
    for kind in ("tab", "pad"):
        sensor = SensorType(overlay=Overlay(kind=kind))
        forces = press(Washer(), sensor, Touch(0, 0, 0, FORCE_N), accuracy=FINEST[kind]).forces_n
        board, rng = Electronics(), np.random.default_rng(options.seed)
        sequence = np.repeat(forces[None], options.frames, axis=0)
        counts, _ = read_sequence(sequence, board, fsr_of(16, 16), None, rng)
        reading = np.maximum(counts.mean(axis=0) - board.bias_lsb, 0.0)
        filtered = median_filter(reading)
        for name, image in (("force", forces), ("reading", reading), ("filtered", filtered)):
            figures = blur(image, blurred)
            print(f"{kind:<9}{name:<11}{100 * figures[0]:>9.1f}{100 * figures[1]:>8.1f}"
                  f"{figures[2]:>9.2f}{figures[3]:>8.3f}")  # fmt: skip
        figure = {"tab": "4.9", "pad": "4.10"}[kind]
        title = f"{kind} overlay (thesis figure {figure}), {FORCE_N:g} N, median of 3x3"
        pictures[title] = median_filter(counts[0].astype(float))
    if options.png:
        frames_picture(pictures, options.png)
        print(f"wrote {options.png}")


def ring() -> np.ndarray:
    """Matter over the sensor, finely sampled, (16 FINE, 16 FINE)."""
    sensor = SensorType(rows=16 * FINE, columns=16 * FINE, pitch_mm=SensorType().pitch_mm / FINE)
    on = np.isfinite(Washer().heights_mm(sensor.centres_mm().reshape(-1, 2)))
    return on.reshape(16 * FINE, 16 * FINE).astype(float)


def tactels(fine: np.ndarray) -> np.ndarray:
    return fine.reshape(16, FINE, 16, FINE).mean(axis=(1, 3))


def blur(image: np.ndarray, blurred: dict[float, np.ndarray]) -> list[float]:
    """The figures of the table; `blurred` is the ring's cover by the deviation of its blur."""
    cover = blurred[0.0]
    radius = np.hypot(*np.moveaxis(SensorType().centres_mm(), -1, 0))
    hole = (cover == 0) & (radius < Washer().inner_mm / 2)
    match = {sigma: np.corrcoef(image.ravel(), c.ravel())[0, 1] for sigma, c in blurred.items()}
    return [image[cover == 0].sum() / image.sum(), image[hole].mean() / image[cover == 1].mean(),
            max(match, key=match.__getitem__), match[0.0]]  # fmt: skip


if __name__ == "__main__":
    main()
