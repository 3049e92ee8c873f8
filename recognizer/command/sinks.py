"""Where images and answers go beside the terminal: the sinks that are asked for."""

from __future__ import annotations

from collections.abc import Iterator

from probe.recording.layout import RecordingOrigin
from recognizer.command.answer_sink import AnswerSink
from recognizer.command.answers import RecognizeOptions


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
