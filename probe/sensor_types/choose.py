"""Which sensor type images are of: what is asked for, else what their file tells, else `fsr-16`."""

from __future__ import annotations

from encoded_objects.base.document import Problem
from probe.sensor import SensorType
from probe.sensor_types.errors import SensorTypeError
from probe.sensor_types.text import sensor_type_text


def choose_sensor_type(
    asked: str | SensorType | None, told: str, shape: tuple[int, int] | None, place: str
) -> SensorType:
    """Return the type of images.

    Parameters
    ----------
    asked
        A type, its name or file, as a person gave it; None or empty: nothing was asked for.
    told
        Text of a type, as a recording carries it; empty: none.
    shape
        Rows and columns of the images; None: not known yet.
    place
        File or URL, for messages.

    Raises
    ------
    SensorTypeError
        Images of another shape than the type, or of a shape that is not the usual one's where
        no type is asked for and none is told.
    """
    if isinstance(asked, SensorType):
        found = asked
    elif asked:
        from probe.sensor_types.read import sensor_type_named

        found = sensor_type_named(asked)
    elif told and told != sensor_type_text(SensorType()):
        from probe.sensor_types.read import parse_sensor_type

        found = parse_sensor_type(told, f"{place}, attribute sensor_type")
    else:
        found = SensorType()
        if shape is not None and shape != found.shape:
            raise _unknown_type(shape, place)
    if shape is not None and shape != found.shape:
        raise SensorTypeError(
            [
                Problem(
                    f"images of {shape[0]} x {shape[1]} readings, {found.name} has "
                    f"{found.rows} x {found.columns}",
                    _fix_for(shape),
                    file=place,
                )
            ]
        )
    return found


def _unknown_type(shape: tuple[int, int], place: str) -> SensorTypeError:
    cause = f"images of {shape[0]} x {shape[1]} readings, and nothing tells their sensor type"
    return SensorTypeError([Problem(cause, _fix_for(shape), file=place)])


def _fix_for(shape: tuple[int, int]) -> str:
    """Return the way out: the shipped types of that shape, or a file."""
    from probe.sensor_types.read import sensor_type_named, shipped_names

    alike = [name for name in shipped_names() if sensor_type_named(name).shape == shape]
    named = f"{' or '.join(alike)}, or " if alike else ""
    return f"give --sensor-type {named}a file; probe-sensor types shows how one is written"
