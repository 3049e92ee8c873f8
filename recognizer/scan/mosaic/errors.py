"""What can be wrong with touches that are to make one image.

::

    RecognizerError       exit code 2
    └── MosaicError       touches without a place, or with places that are none
"""

from __future__ import annotations

from recognizer.errors import RecognizerError


class MosaicError(RecognizerError):
    """Touches that cannot stand in one plane: no place, no covariance, two sensors."""
