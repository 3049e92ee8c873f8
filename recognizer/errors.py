"""What can be wrong with what the reader is given.

::

    EncodedObjectsError       exit code 2
    └── RecognizerError
        ├── LabError          the database holds nothing that can be read by touch
        ├── TouchError        an image that is none of the sensor's
        ├── AsBuiltError      touches that do not tell how a part was printed
        ├── MosaicError       touches without a pose in one plane, or a pose that is none
        ├── WiringError       a change of the image that there is not
        └── SensorStateError  a file that does not tell of a sensor, or tells of another one

A touch that is not recognised is no error but a value with a reason (`recognition`).
"""

from __future__ import annotations

from encoded_objects.base.errors import EncodedObjectsError


class RecognizerError(EncodedObjectsError):
    """Base of all errors of `recognizer`."""


class LabError(RecognizerError):
    """A database without an object, or without the one that is named, to be read by touch."""


class TouchError(RecognizerError):
    """An image of another shape than the sensor, or of values that are no numbers."""


class AsBuiltError(RecognizerError):
    """Touches that do not tell how a part was printed."""


class MosaicError(RecognizerError):
    """Touches that cannot lie in one plane: no pose, no covariance, two sensors."""


class SensorStateError(RecognizerError):
    """A file that is no state of a sensor, or another sensor's."""


class WiringError(RecognizerError):
    """A change of the image that is not known, or that the matrix does not allow."""
