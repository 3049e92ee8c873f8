"""What can be wrong with a probe, its data, or a simulated scene.

::

    EncodedObjectsError       exit code 2
    └── ProbeError
        ├── FrameError        an image that is no matrix of readings
        ├── PortError         exit code 3: no such device, busy, gone, or not our probe
        │   └── PortUrlError  exit code 2: a port URL or an option in it that means nothing
        ├── RecordingError    a file that is no recording, damaged, or of a newer format
        ├── CalibrationError  too few loads, loads that do not determine the law
        ├── SurfaceError      a mesh or a face that gives no height map
        ├── ContactError      a scene without an equilibrium, or out of a model's range
        ├── CircuitError      a network that cannot be read or inverted as asked
        └── PoseError         wrist or arm outside its range, or near a singularity

A sensor type that cannot be used is a `SensorTypeError` of `encoded_objects.base.sensor_type`.
Every error says what was given, what is allowed, and the way out (`fix`).
"""

from __future__ import annotations

from encoded_objects.base.errors import EncodedObjectsError


class ProbeError(EncodedObjectsError):
    """Base of all errors of `probe`."""


class FrameError(ProbeError):
    """An image that is no matrix of readings of the ADC's range."""


class PortError(ProbeError):
    """A device that is not there, is used by another, went away, or is no probe."""

    exit_code = 3


class PortUrlError(PortError):
    """A port URL that cannot be read, or an option in it that is out of its range."""

    exit_code = 2


class RecordingError(ProbeError):
    """A file that is no recording, is damaged, or is of a newer format."""


class CalibrationError(ProbeError):
    """Loads that are too few or do not determine the force law, or another sensor's file."""


class SurfaceError(ProbeError):
    """A mesh, a face or an array that gives no height map."""


class ContactError(ProbeError):
    """A scene without an equilibrium, or outside the range of the model."""


class CircuitError(ProbeError):
    """A network that cannot be read or inverted as asked."""


class PoseError(ProbeError):
    """A wrist or an arm outside its range, or too near a singularity to tell its pose."""
