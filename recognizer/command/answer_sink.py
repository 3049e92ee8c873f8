"""What a sink is: it takes images and answers as they come."""

from __future__ import annotations

from abc import abstractmethod

from probe.closing import Closing
from probe.frame import Frame
from recognizer.command.answers import Answer


class AnswerSink(Closing):
    """What takes images and answers as they come."""

    @abstractmethod
    def frame(self, frame: Frame) -> None:
        """Take an image."""

    @abstractmethod
    def answer(self, answer: Answer) -> None:
        """Take an answer."""
