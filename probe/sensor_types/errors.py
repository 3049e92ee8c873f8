"""What can be wrong with a sensor type."""

from __future__ import annotations

from encoded_objects.base.document import DocumentError
from probe.errors import ProbeError


class SensorTypeError(DocumentError, ProbeError):
    """A sensor type that is not known, or a file of one that cannot be used."""
