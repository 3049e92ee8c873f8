"""`--learn FILE` and `--sensor-state FILE`: a sensor is learned while its touches are read.

A recording is learned from before its touches are read, each by what others say; a port every
`EVERY` touches, and at its end. What is known is kept in the file each time, whole or not at all.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from encoded_objects.base.output import message, progress_bar
from recognizer.errors import SensorStateError
from recognizer.touch.reader import Reader
from recognizer.touch.source import TouchImage, TouchSource

if TYPE_CHECKING:
    from recognizer.sensor.learn import LearnedSensor

EVERY = 25  #: touches of a port after which the sensor is learned again
MOST = 200  #: touches of a recording that are learned from


@dataclass(slots=True)
class SensorLearning:
    """A reader, and what is being learned of its sensor."""

    reader: Reader
    source: TouchSource
    path: Path | None  #: where it is kept; None: nothing is learned
    waiting: list[TouchImage] = field(default_factory=list)  #: touches not learned from yet
    learned: LearnedSensor | None = None  #: of a recording whose touches are read next
    taken: int = 0  #: touches of it that were read

    def learn_from(self, touches: Iterable[TouchImage]) -> None:
        """Learn from the touches of a recording, which are read afterwards."""
        if self.path is None:
            return
        with progress_bar("touches", self.source.frames) as bar:
            for touch in touches:
                self.waiting.append(touch)
                bar.show(touch.seq + touch.frames, f"{len(self.waiting):,} touches")
                if len(self.waiting) >= MOST:
                    break
        self.learned = self._learn()

    def take(self, touch: TouchImage) -> Reader:
        """Return the reader of a touch; learn from those before it where there are enough."""
        if self.learned is not None:
            number, self.taken = self.taken, self.taken + 1
            if number < MOST:
                return replace(self.reader, state=self.learned.without(number))
        elif self.path is not None:
            if len(self.waiting) >= EVERY:
                self._learn()
            self.waiting.append(touch)
        return self.reader

    def end(self) -> None:
        """Learn from the touches that are left."""
        from recognizer.sensor.learn import LEAST_TOUCHES

        if len(self.waiting) >= LEAST_TOUCHES:
            self._learn()

    def _learn(self) -> LearnedSensor:
        from recognizer.sensor.file import state_words, write_state
        from recognizer.sensor.learn import learn_folds

        assert self.path is not None
        images = [touch.counts for touch in self.waiting]
        with progress_bar("learning the sensor", 1.0) as bar:
            learned = learn_folds(
                self.reader, images, calibration=self.source.calibration, name=self.source.name,
                done=bar.show,
            )  # fmt: skip
        write_state(learned.state, self.path)
        message(f"learned of {state_words(learned.state)}; kept in {self.path}")
        self.reader = replace(self.reader, state=learned.state)
        self.waiting.clear()
        return learned


def learning_for(
    reader: Reader, source: TouchSource, learn: Path | None, state: Path | None
) -> SensorLearning:
    """Return a reader that knows what was learned of its sensor, and may go on learning.

    It is kept in the file `learn`, and begun by it if it is there; `state` is one to read by alone.

    Raises SensorStateError: the file is no state of this sensor, or there is no folder for it.
    """
    known = state or (learn if learn is not None and learn.exists() else None)
    if learn is not None and not learn.parent.is_dir():
        raise SensorStateError(
            f"there is no folder {learn.parent}", fix="make it first", place=str(learn)
        )
    if known is not None:
        from recognizer.sensor.file import read_state

        names = (source.name, reader.sensor.name) if source.name else ()
        reader = replace(reader, state=read_state(known, sensors=names))
    return SensorLearning(reader, source, learn)
