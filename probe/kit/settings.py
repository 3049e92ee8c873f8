"""Numbers that decide what the parts of a probe measure. Lengths in mm."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class KitSettings:
    """What a sensor type does not say."""

    # the film
    border_mm: float = 6.0  #: of the film around the matrix: leads and adhesive; measure yours
    film_mm: float = 0.4  #: its thickness
    tail_mm: float = 26.0  #: width of its tail, at the lower edge

    # the overlay
    web_mm: float = 0.4  #: skin that joins the tabs; two layers of filament, eight of resin
    rim_mm: float = 4.0  #: of the skin beyond the film, for the holes that register it
    draft_rad: float = math.radians(3.0)  #: of a tab, wider at its foot; less where feet would meet
    wall_between_mm: float = 0.2  #: of the mould, between the feet of two tabs: resin prints it

    # the mould
    around_mm: float = 12.0  #: of mould beyond the skin: pins and screws
    pocket_mm: float = 4.0  #: depth of the pocket that the lid enters
    plate_mm: float = 4.0  #: of base and lid
    clearance_mm: float = 0.15  #: each side, of what slides into something
    vent_mm: tuple[float, float] = (
        0.3,
        0.15,
    )  #: width (at most) and depth of vents below tips
    riser_mm: float = 1.5  #: diameter of the holes through which silicone rises into the lid

    # pins, screws, flange
    pin_mm: float = 3.0  #: dowels of the mould, and posts that register the overlay
    screw_mm: float = 3.4  #: hole for M3
    head_mm: tuple[float, float] = (6.4, 3.4)  #: counterbore of an M3 head: diameter, depth
    flange_circle_mm: float = 50.0  #: ISO 9409-1-50-4-M6, the flange of small robot arms
    flange_screw_mm: float = 6.6  #: hole for M6
    flange_head_mm: tuple[float, float] = (11.0, 6.8)  #: counterbore of an M6 head
    flange_spigot_mm: tuple[float, float] = (31.5, 3.0)  #: recess over the flange's spigot

    # the housing
    side_mm: float = 64.0  #: at least, of its square: the flange's screws
    corner_mm: float = 5.0  #: of its screws from both sides
    shoulder_mm: float = 8.0  #: of the body under the frame
    platform_mm: float = 4.0  #: by which what bears the film stands above the shoulder
    free_mm: float = 0.8  #: by which tips stand above the frame, so that faces meet tips alone
    opening_mm: float = 0.5  #: of the frame beyond the matrix, each side
    bend_mm: float = 2.0  #: radius over which the tail leaves the platform
    adapter_mm: float = 10.0  #: thickness of the plate on the robot's flange
    tongue_mm: float = 14.0  #: length of what bears tail and cable beside the housing
    tie_mm: tuple[float, float] = (4.0, 2.0)  #: slots in it for the cable tie that relieves them

    # the cap
    skirt_mm: float = 2.0  #: thickness of what guides it over the frame
    guided_mm: float = 4.0  #: by which the skirt reaches over the frame when the foot bears
    pan_mm: float = 62.0  #: diameter of the ring on its pan, to centre weights by
    ring_mm: tuple[float, float] = (1.0, 0.6)  #: width and depth of that ring
    foam_mm: float = 2.0  #: under its foot

    # the coupon
    coupon_pitches: float = 4.0  #: of symbols beyond the sensor's longer side
    coupon_mm: float = 10.0  #: height of the box whose one panel is printed

    # files
    chord_mm: float = 0.03  #: of the mesh against true circles
    chord_rad: float = 0.45  #: and against their turn


KIT = KitSettings()
