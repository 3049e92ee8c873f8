"""How much of an image given symbols explain where they stand.

Image + lattice + what its cells show -> share of the variance of psi. Lattice and sensor frame, mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.symbols.compiled import explained_share_compiled
from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.kernels import compiled_kernels
from recognizer.touch.symbols.noise import reading_deviation
from recognizer.touch.symbols.projection import Shown, project_symbols
from recognizer.touch.symbols.template import ResponseTemplate

Array = NDArray[np.float64]


def explained_share(
    image: Image, template: ResponseTemplate, pose: Array, gain: Array, shown: Shown
) -> float:
    """Return the share of the variance of psi that given symbols explain where they stand.

    It is less than 0 where they explain nothing. What the noise of readings alone would leave is
    taken off first.

    Parameters
    ----------
    pose, gain
        (7,) and (4,) of one lattice.
    """
    library = compiled_kernels()
    if library is not None:
        return explained_share_compiled(library, image, template, pose, gain, shown)
    felt, labels, shows = project_symbols(image, template, pose[None], gain[None], shown)
    values, seen = shows[0, :, 0], felt.psi[0]
    trust = image.trust * (labels[0] >= 0)
    if image.falls is not None:  # where the face has fallen away there is nothing to explain
        trust = trust * felt.contact[0]
    # no symbol explains the noise of readings: it counts less where it is large, and is taken off
    settings = image.settings.noise
    noise = reading_deviation(felt, values[None, :, None])[0, :, 0]
    trust = trust / (1.0 + (noise / (settings.quiet * settings.first)) ** 2)
    mean = (trust * seen).sum() / max(trust.sum(), 1e-12)
    whole = float((trust * (seen - mean) ** 2).sum())
    left = float((trust * (seen - values) ** 2).sum())
    above = np.where(values > settings.grazed, 1.0, settings.above)
    noise_alone = min(float((trust * above * noise**2).sum()), settings.hidden * whole, left)
    return 1.0 - (left - noise_alone) / max(whole - noise_alone, 1e-12)
