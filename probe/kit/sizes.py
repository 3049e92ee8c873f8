"""What the parts of a probe measure: sensor type + settings -> lengths in mm.

Sensor frame in x and y (origin at the middle of the matrix); z as each part lies on the bed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from encoded_objects.base.sensor_type import SensorType
from probe.kit.settings import KIT, KitSettings


@dataclass(frozen=True, slots=True)
class KitSizes:
    """Lengths that several parts share."""

    sensor: SensorType
    settings: KitSettings
    tip_mm: float  #: diameter of a tab's tip; 0: no tabs
    foot_mm: float  #: and at its foot, on the skin
    draft_rad: float  #: that the mould has
    vent_mm: float  #: width of a vent
    film_mm: tuple[float, float]  #: width and height of the film
    skin_mm: tuple[float, float]  #: of the skin, and of the platform
    mould_mm: tuple[float, float]  #: of base, plate and lid
    side_mm: tuple[float, float]  #: of the housing
    coupon_mm: float  #: side of the coupon

    @property
    def thickness_mm(self) -> float:
        """Of the overlay above the film: skin and tabs, or the pad."""
        tabs = self.sensor.overlay.kind == "tab"
        return self.sensor.overlay.height_mm + (self.settings.web_mm if tabs else 0.0)

    @property
    def thickness_skin_mm(self) -> float:
        """Of the overlay's rim, that the frame holds down."""
        return self.settings.web_mm if self.tip_mm else self.thickness_mm

    @property
    def lip_mm(self) -> float:
        """Of the frame over the rim: tips stand `free_mm` above it."""
        return max(self.thickness_mm - self.thickness_skin_mm - self.settings.free_mm, 1.2)

    @property
    def posts_mm(self) -> tuple[tuple[float, float], ...]:
        """Places of the posts that register the overlay, in the rim of the skin."""
        x, y = ((side - self.settings.rim_mm) / 2 for side in self.skin_mm)
        return ((x, y), (-x, y), (-x, -y), (x, -y))

    @property
    def silicone_mm3(self) -> float:
        """Volume of the overlay."""
        skin = math.prod(self.skin_mm)
        if not self.tip_mm:
            return skin * self.thickness_mm
        return skin * self.settings.web_mm + self.tabs * frustum_mm3(
            self.tip_mm, self.foot_mm, self.sensor.overlay.height_mm
        )

    @property
    def tabs(self) -> int:
        """How many tabs."""
        return int(self.sensor.present().sum())


def frustum_mm3(one_mm: float, other_mm: float, height_mm: float) -> float:
    """Return the volume between two discs of given diameters."""
    a, b = one_mm / 2, other_mm / 2
    return math.pi * height_mm * (a * a + a * b + b * b) / 3


def kit_sizes(sensor: SensorType, pitch_mm: float, settings: KitSettings = KIT) -> KitSizes:
    """Return the sizes of a probe's parts.

    Parameters
    ----------
    sensor
        Its type.
    pitch_mm
        Of the symbols that it will touch.
    settings
        What a type does not say.
    """
    overlay, s = sensor.overlay, settings
    tip = overlay.tab_diameter_mm if overlay.kind == "tab" else 0.0
    widest = min(sensor.step_mm) - s.wall_between_mm
    foot = min(tip + 2 * overlay.height_mm * math.tan(s.draft_rad), max(widest, tip))
    half = sensor.half_mm
    film = tuple(2 * h + 2 * s.border_mm for h in half)
    skin = tuple(side + 2 * s.rim_mm for side in film)
    mould = tuple(side + 2 * s.around_mm for side in skin)
    # The frame's wall stands around the platform, and its screws in its corners.
    housing = tuple(max(side + 2 * (2 * s.corner_mm), s.side_mm) for side in skin)
    coupon = 2 * max(half) + s.coupon_pitches * pitch_mm
    return KitSizes(
        sensor=sensor,
        settings=s,
        tip_mm=tip,
        foot_mm=foot if tip else 0.0,
        draft_rad=math.atan((foot - tip) / 2 / overlay.height_mm) if tip else 0.0,
        vent_mm=min(s.vent_mm[0], (sensor.pitch_mm - tip) / 2) if tip else 0.0,
        film_mm=(film[0], film[1]),
        skin_mm=(skin[0], skin[1]),
        mould_mm=(mould[0], mould[1]),
        side_mm=(housing[0], housing[1]),
        coupon_mm=math.ceil(coupon / 5) * 5.0,
    )
