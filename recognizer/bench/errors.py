"""What can be wrong with what the page, or who speaks in its place, asks for."""

from __future__ import annotations

from typing import Any

from recognizer.errors import RecognizerError


class BenchError(RecognizerError):
    """A request that cannot be met: what was asked, what is allowed, the way out."""

    status = 400  #: of the answer


class RefusedError(BenchError):
    """What `encode-object` refuses, in its words: `error` as it prints it."""

    def __init__(self, error: dict[str, Any]) -> None:
        super().__init__(error["cause"], fix=error["fix"], place=error["place"])
        self.problems = error.get("problems", [])

    def as_json(self) -> dict[str, Any]:
        """Return the first problem as every error, and all of them under `problems`."""
        return super().as_json() | {"problems": self.problems}


class UnknownError(BenchError):
    """A thing that is not there, or that the page has no business with."""

    status = 404


class BusyError(BenchError):
    """A thing that cannot be done now: something else is going on."""

    status = 409


class TooLongError(BenchError):
    """More bytes than are taken."""

    status = 413
