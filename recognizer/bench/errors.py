"""What can be wrong with what the page, or who speaks in its place, asks for."""

from __future__ import annotations

from recognizer.errors import RecognizerError


class BenchError(RecognizerError):
    """A request that cannot be met: what was asked, what is allowed, the way out."""

    status = 400  #: of the answer


class UnknownError(BenchError):
    """A thing that is not there, or that the page has no business with."""

    status = 404


class BusyError(BenchError):
    """A thing that cannot be done now: something else is going on."""

    status = 409


class TooLongError(BenchError):
    """More bytes than are taken."""

    status = 413
