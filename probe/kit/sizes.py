"""Sizes of the parts of a probe: sensor type -> lengths in mm.

Sensor frame in x and y (origin at the middle of the matrix); z as each part lies on the bed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from encoded_objects.base.sensor_type import SensorType

# Of the film:
BORDER_MM = 6.0  #: of the film around the matrix: leads and adhesive; measure yours
FILM_MM = 0.4  #: its thickness
TAIL_MM = 26.0  #: width of its tail, at the lower edge
# Of the overlay:
WEB_MM = 0.4  #: skin that joins the tabs; two layers of filament, eight of resin
RIM_MM = 4.0  #: of the skin beyond the film, for the holes that register it
DRAFT_RAD = math.radians(3.0)  #: of a tab, wider at its foot; less where feet would meet
WALL_BETWEEN_MM = 0.2  #: of the mould, between the feet of two tabs: resin prints it
# Of the mould:
AROUND_MM = 12.0  #: of mould beyond the skin: pins and screws
POCKET_MM = 4.0  #: depth of the pocket that the lid enters
PLATE_MM = 4.0  #: of base and lid
CLEARANCE_MM = 0.15  #: each side, of sliding fits
VENT_MM = (0.3, 0.15)  #: width (at most) and depth of vents below tips
RISER_MM = 1.5  #: diameter of the holes through which silicone rises into the lid
# Of pins, screws, flange:
PIN_MM = 3.0  #: dowels of the mould, and posts that register the overlay
SCREW_MM = 3.4  #: hole for M3
HEAD_MM = (6.4, 3.4)  #: counterbore of an M3 head: diameter, depth
FLANGE_CIRCLE_MM = 50.0  #: ISO 9409-1-50-4-M6, the flange of small robot arms
FLANGE_SCREW_MM = 6.6  #: hole for M6
FLANGE_HEAD_MM = (11.0, 6.8)  #: counterbore of an M6 head
FLANGE_SPIGOT_MM = (31.5, 3.0)  #: recess over the flange's spigot
# Of the housing:
SIDE_MM = 64.0  #: at least, of its square: the flange's screws
CORNER_MM = 5.0  #: of its screws from both sides
SHOULDER_MM = 8.0  #: of the body, under the frame
PLATFORM_MM = 4.0  #: height of the film's platform above the shoulder
FREE_MM = 0.8  #: height of the tips above the frame: faces meet tips alone
OPENING_MM = 0.5  #: of the frame beyond the matrix, each side
BEND_MM = 2.0  #: radius over which the tail leaves the platform
ADAPTER_MM = 10.0  #: thickness of the plate on the robot's flange
TONGUE_MM = 14.0  #: length of the support of tail and cable next to the housing
TIE_MM = (4.0, 2.0)  #: slots in it for a cable tie, the strain relief
# Of the cap:
SKIRT_MM = 2.0  #: thickness of the sleeve that guides it over the frame
GUIDED_MM = 4.0  #: by which the skirt reaches over the frame when the foot bears
PAN_MM = 62.0  #: diameter of the ring on its pan, to centre weights by
RING_MM = (1.0, 0.6)  #: width and depth of that ring
FOAM_MM = 2.0  #: under its foot
# Of the coupon:
COUPON_PITCHES = 4.0  #: of symbols beyond the sensor's longer side
COUPON_MM = 10.0  #: height of the box whose one panel is printed


@dataclass(frozen=True, slots=True)
class KitSizes:
    """Lengths that several parts share."""

    sensor: SensorType
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
        return self.sensor.overlay.height_mm + (WEB_MM if tabs else 0.0)

    @property
    def thickness_skin_mm(self) -> float:
        """Of the overlay's rim, that the frame holds down."""
        return WEB_MM if self.tip_mm else self.thickness_mm

    @property
    def lip_mm(self) -> float:
        """Of the frame over the rim: tips stand `free_mm` above it."""
        return max(self.thickness_mm - self.thickness_skin_mm - FREE_MM, 1.2)

    @property
    def posts_mm(self) -> tuple[tuple[float, float], ...]:
        """Places of the posts that register the overlay, in the rim of the skin."""
        return corners(self.skin_mm, RIM_MM / 2)

    @property
    def screws_mm(self) -> tuple[tuple[float, float], ...]:
        """Places of the housing's screws."""
        return corners(self.side_mm, CORNER_MM)

    @property
    def silicone_mm3(self) -> float:
        """Volume of the overlay."""
        skin = math.prod(self.skin_mm)
        if not self.tip_mm:
            return skin * self.thickness_mm
        return skin * WEB_MM + self.tabs * frustum_mm3(
            self.tip_mm, self.foot_mm, self.sensor.overlay.height_mm
        )

    @property
    def tabs(self) -> int:
        """How many tabs."""
        return int(self.sensor.present().sum())


def corners(sides_mm: tuple[float, float], inward_mm: float) -> tuple[tuple[float, float], ...]:
    """Return four places (x, y) inward of the corners of a rectangle about the origin."""
    x, y = (side / 2 - inward_mm for side in sides_mm)
    return ((x, y), (-x, y), (-x, -y), (x, -y))


def frustum_mm3(one_mm: float, other_mm: float, height_mm: float) -> float:
    """Return the volume between two discs of given diameters."""
    a, b = one_mm / 2, other_mm / 2
    return math.pi * height_mm * (a * a + a * b + b * b) / 3


def kit_sizes(sensor: SensorType, pitch_mm: float) -> KitSizes:
    """Return the sizes of a probe that touches symbols of a pitch."""
    overlay = sensor.overlay
    tip = overlay.tab_diameter_mm if overlay.kind == "tab" else 0.0
    widest = min(sensor.step_mm) - WALL_BETWEEN_MM
    foot = min(tip + 2 * overlay.height_mm * math.tan(DRAFT_RAD), max(widest, tip))
    half = sensor.half_mm
    film = tuple(2 * h + 2 * BORDER_MM for h in half)
    skin = tuple(side + 2 * RIM_MM for side in film)
    mould = tuple(side + 2 * AROUND_MM for side in skin)
    # The frame's wall stands around the platform, and its screws in its corners.
    housing = tuple(max(side + 2 * (2 * CORNER_MM), SIDE_MM) for side in skin)
    coupon = 2 * max(half) + COUPON_PITCHES * pitch_mm
    return KitSizes(
        sensor=sensor,
        tip_mm=tip,
        foot_mm=foot if tip else 0.0,
        draft_rad=math.atan((foot - tip) / 2 / overlay.height_mm) if tip else 0.0,
        vent_mm=min(VENT_MM[0], (sensor.pitch_mm - tip) / 2) if tip else 0.0,
        film_mm=(film[0], film[1]),
        skin_mm=(skin[0], skin[1]),
        mould_mm=(mould[0], mould[1]),
        side_mm=(housing[0], housing[1]),
        coupon_mm=math.ceil(coupon / 5) * 5.0,
    )
