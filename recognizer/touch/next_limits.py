"""The steps and forces that suit a sensor type, of those that suit the usual one."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from encoded_objects.base.sensor_type import SensorType, force_share
from recognizer.touch.settings import DEFAULTS, NextSettings


@lru_cache(maxsize=16)
def next_limits(sensor: SensorType, settings: NextSettings = DEFAULTS.next) -> NextSettings:
    """Return the settings for a type: steps as long for its size, as hard as it is pressed.

    Steps of larger sensors are no longer than those of `fsr-16`: 16 of 16 touches of `mat-32x32`
    at edges were answered by the third, 13 with steps as long for its size. What is felt at all is
    told by the full scale, or by the noise where that is more; gaps between strokes are no wider in
    mm where tactels are coarse.

    Examples
    --------
    >>> next_limits(SensorType()) == NextSettings()
    True
    """
    usual = SensorType()
    size = min(1.0, math.sqrt(math.prod(sensor.half_mm) / math.prod(usual.half_mm)))
    scale = sensor.full / usual.full
    reach = settings.gap // 2
    reach = max(1, min(reach, round(reach * usual.pitch_mm / max(sensor.step_mm))))
    return replace(
        settings,
        lengths_mm=tuple(size * length for length in settings.lengths_mm),
        clear_mm=size * settings.clear_mm,
        force_n=round(force_share(sensor) * settings.force_n, 1),
        least_counts=max(scale * settings.least_counts, settings.quiet_sigmas * sensor.noise),
        soft_counts=scale * settings.soft_counts,
        gap=2 * reach + 1,
    )
