"""Answers -> their pictures: one file, or one for every touch with its number."""

from __future__ import annotations

from pathlib import Path
from threading import Event

from encoded_objects.base.errors import require
from encoded_objects.base.files import file_exists_error, refuse_taken, staged_file
from encoded_objects.base.output import progress_bar
from recognizer.command.answers import Answer
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchSource


def refuse_pictures(plot: Path, *, replace: bool) -> None:
    """Refuse a picture's name that is taken, also by that of one of several touches."""
    refuse_taken(plot, ".png", replace=replace)
    require("matplotlib", extra="report", purpose="--plot")
    there = [
        path
        for path in plot.parent.glob(f"{plot.stem}-*.png")
        if path.stem.removeprefix(f"{plot.stem}-").isdecimal()
    ]
    if there and not replace:
        raise file_exists_error(there[0])


def draw_answers(
    reader: Reader, source: TouchSource, answers: list[Answer], plot: Path, interrupted: Event
) -> None:
    """Draw the answers: one into the file, several into files with their numbers."""
    with progress_bar("drawing", len(answers)) as bar:
        for number, answer in enumerate(answers, start=1):
            if interrupted.is_set():
                return
            one = len(answers) == 1
            path = plot if one else plot.with_stem(f"{plot.stem}-{answer.touch.seq}")
            draw_answer(reader, source, answer, path)
            bar.show(number, f"{number:,} of {len(answers):,}")


def draw_answer(reader: Reader, source: TouchSource, answer: Answer, path: Path) -> None:
    """Draw what a touch felt, and what it says."""
    from recognizer.command.plot.touch import touch_picture

    pose = None if answer.in_base is None else answer.in_base.T_robot_object
    with staged_file(path) as draft:
        signal = reader.signal(answer.touch.counts, calibration=source.calibration)
        touch_picture(reader, signal, answer.found, draft, T_robot_object=pose)
