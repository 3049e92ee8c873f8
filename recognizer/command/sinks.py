"""Where images and answers go beside the terminal: each sink takes them as they come."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING

from probe.closing import Closing
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin

if TYPE_CHECKING:
    from recognizer.command.answers import Answer, RecognizeOptions


class AnswerSink(Closing):
    """What takes images and answers as they come."""

    @abstractmethod
    def frame(self, frame: Frame) -> None:
        """Take an image."""

    @abstractmethod
    def answer(self, answer: Answer) -> None:
        """Take an answer."""


def sinks_for(options: RecognizeOptions, origin: RecordingOrigin) -> Iterator[AnswerSink]:
    """Yield the sinks that are asked for; what they need loads now.

    Raises
    ------
    EncodedObjectsError
        A file is there already.
    MissingExtraError
        What a sink needs is not installed.
    """
    if options.mcap is not None:
        from recognizer.command.ros import McapSink

        yield McapSink(options.mcap, origin, replace=options.replace)
    if options.publish:
        from recognizer.command.publish import PublishSink

        yield PublishSink(options.publish)
