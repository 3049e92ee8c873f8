"""The project's own engine: tabs as columns under a plate; a pad by the ladder's usual level."""

from __future__ import annotations

from encoded_objects.base.sensor_type import SensorType
from probe.contact import press as ladder
from probe.contact.contract import Contact, Touch
from probe.contact.engines import Engine
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.surface.contract import HeightMap


def press(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips) -> Contact:
    """Press a sensor on a surface; see `probe.contact.press`. A pad has no tips to be off."""
    if sensor.overlay.kind == "tab":
        return tabs(surface, sensor, touch, tips)
    return ladder.press(surface, sensor, touch)


ENGINE = Engine(press, points=19, overlays=("tab", "pad", "gel"))
