"""What can be wrong with what the reader is given.

::

    RecognizerError       exit code 2
    └── LabError          the database holds nothing that can be read by touch

A touch that is not recognised is no error but a value with a reason (`recognition`).
"""

from __future__ import annotations


class RecognizerError(Exception):
    """Base of all errors of `recognizer`: cause, way out (`fix`), and place."""

    exit_code = 2

    def __init__(self, cause: str, *, fix: str = "", place: str = "") -> None:
        super().__init__(cause)
        self.cause = cause
        self.fix = fix
        self.place = place

    def __str__(self) -> str:
        head = f"{self.place}: {self.cause}" if self.place else self.cause
        return f"{head}; {self.fix}" if self.fix else head


class LabError(RecognizerError):
    """A database without an object that can be read by touch."""
