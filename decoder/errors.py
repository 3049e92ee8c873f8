"""What can be wrong with what is given to the decoder.

::

    EncodedObjectsError     exit code 2
    └── DecoderError
        ├── WindowError     a window that is no window of this array's symbols
        └── MethodError     a method that does not serve this array, or not at this size

A window that cannot be decoded is no error: it is a `Decoded` with a reason.
"""

from __future__ import annotations

from encoded_objects.base.errors import EncodedObjectsError


class DecoderError(EncodedObjectsError):
    """Base of all errors of `decoder`."""


class WindowError(DecoderError):
    """A window of the wrong shape, with unknown labels, or with scores that are not finite."""


class MethodError(DecoderError):
    """A method that does not serve this array, or would not end at its size."""
