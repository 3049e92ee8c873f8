"""A sensor type -> YAML that gives it again, as recordings and runs carry it."""

from __future__ import annotations

from probe.sensor import SensorType


def sensor_type_text(sensor: SensorType) -> str:
    """Return a type as YAML that gives it again, the same text for the same type.

    Examples
    --------
    >>> from probe.sensor_types.read import parse_sensor_type
    >>> parse_sensor_type(sensor_type_text(SensorType()), "text") == SensorType()
    True
    """
    overlay = sensor.overlay
    lines = [
        "version: 1",
        f"name: {sensor.name}",
        f"rows: {sensor.rows}",
        f"columns: {sensor.columns}",
        f"pitch: {sensor.pitch_mm!r} mm",
        *([f"row_pitch: {sensor.row_pitch_mm!r} mm"] if sensor.row_pitch_mm else []),
        "overlay:",
        f"  kind: {overlay.kind}",
        f"  height: {overlay.height_mm!r} mm",
        f"  tip: {overlay.tab_diameter_mm!r} mm",
        f"  young: {overlay.young_mpa!r}",
        f"  poisson: {overlay.poisson!r}",
        f"  membrane: {overlay.membrane_mm!r} mm",
        f"  blur: {overlay.blur_mm!r} mm",
        f"value: {sensor.value}",
        f"unit: {sensor.unit!r}",
        f"bits: {sensor.bits}",
        f"exponent: {sensor.exponent!r}",
        f"wiring: {sensor.wiring}",
        f"noise: {sensor.noise!r}",
        *(["missing:"] if sensor.missing else []),
        *(f"  - {{rows: {row}, columns: {column}}}" for row, column in sensor.missing),
    ]
    return "\n".join(lines) + "\n"
