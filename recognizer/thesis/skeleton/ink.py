"""Image -> where the sensor feels a plateau. Thesis 6.1, 6.2.

Tactels do not press alike all over an image (a tilted sensor, touches of different force in a
mosaic), so the threshold is a share of what is felt most nearby, not of the whole image.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.settings import INK
from recognizer.touch.tactile_image import TactileImage


def ink(image: TactileImage, reach_mm: float, share: float) -> NDArray[np.bool_]:
    """Return where (h, w) an image shows strokes.

    Parameters
    ----------
    image
        Of 0 where nothing is felt.
    reach_mm
        How far the strongest reading nearby may be away: about a symbol's pitch.
    share
        Of that reading, from which a sample belongs to a stroke.
    """
    from scipy.ndimage import maximum_filter, uniform_filter

    if not image.defined.any():
        return np.zeros(image.values.shape, np.bool_)
    size = 2 * round(reach_mm / 2 / image.step_mm) + 1
    nearby = uniform_filter(maximum_filter(image.values, size), size, mode="nearest")
    least = INK.faint * np.quantile(image.values[image.defined], 0.99)
    return np.asarray((image.values > share * nearby) & (nearby > least) & image.defined)
