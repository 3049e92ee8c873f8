"""Errors of `validate-set`.

::

    RecognizerError
        ValidationError
        WorkersError
        SetError
"""

from __future__ import annotations

from encoded_objects.base.console import DATABASE, FAILED
from recognizer.errors import RecognizerError


class ValidationError(RecognizerError):
    """A set, a folder or an option with which nothing can be validated."""


class WorkersError(RecognizerError):
    """Processes or a cluster that are lost, or that do not see the same set."""

    exit_code = FAILED


class SetError(RecognizerError):
    """Parts that cannot be made, or files that are not what the database registers."""

    def __init__(
        self, cause: str, *, fix: str = "", place: str = "", exit_code: int = DATABASE
    ) -> None:
        super().__init__(cause, fix=fix, place=place)
        self.exit_code = exit_code  # that of `encode-object` where it says what is wrong
