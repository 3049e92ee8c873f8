"""Every touch of the session as one record, which all panels show.

A touch is felt, read, and answered or refused; while it moves it is `moving`, and when the
probe leaves it is no longer in `contact`. An answer belongs to its record alone: a new touch
begins without one. Topic `touch`: the newest record. Topic `touches`: others were named or deleted.
"""

from __future__ import annotations

import csv
import io
import threading
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Any, Literal

from probe.frame import Frame
from recognizer.bench.broker import Broker
from recognizer.bench.errors import BenchError, UnknownError

KEPT = 1000  #: newest touches
NAME_LENGTH = 80  #: characters that a touch's name may have

State = Literal["felt", "reading", "answered", "refused"]


@dataclass(frozen=True, slots=True, eq=False)
class TouchRecord:
    """One touch."""

    number: int  #: from 1 on
    felt_ms: float  #: when its first frame came, ms since 1970
    frame: Frame  #: that was read; until then the first one
    state: State = "felt"
    contact: bool = True
    moving: bool = False  #: what is felt now is not what was read
    answer: dict[str, Any] | None = None
    name: str = ""
    recording: str = ""  #: that is replayed; empty: it was felt just now
    at_s: float = 0.0  #: when in the recording

    def as_json(self) -> dict[str, Any]:
        """Return all but the image, for the page."""
        return {
            "number": self.number, "felt_ms": self.felt_ms, "time_s": self.frame.t_ns * 1e-9,
            "state": self.state, "contact": self.contact, "moving": self.moving,
            "answer": self.answer, "name": self.name,
            "recording": self.recording, "at_s": round(self.at_s, 3),
        }  # fmt: skip


class TouchLog:
    """The records; any thread may call. A number without a record is an `UnknownError`."""

    def __init__(self, broker: Broker) -> None:
        self._broker = broker
        self._turn = threading.Lock()
        self._records: OrderedDict[int, TouchRecord] = OrderedDict()
        self._number = self._changes = 0

    @property
    def newest(self) -> int:
        """Number of the newest touch, 0 if there was none."""
        return self._number

    def is_new(self) -> bool:
        """Whether the newest touch is still there and was not read yet."""
        with self._turn:
            held = self._records.get(self._number)
            return held is not None and held.contact and held.state == "felt"

    def begin(self, frame: Frame, felt_ms: float, recording: str = "", at_s: float = 0.0) -> None:
        """Begin a touch, of a recording if one is named: its record knows nothing yet."""
        with self._turn:
            self._number += 1
            self._put(TouchRecord(self._number, felt_ms, frame, recording=recording, at_s=at_s))
            while len(self._records) > KEPT:
                self._records.popitem(last=False)

    def read(self, frame: Frame) -> None:
        """Mark the newest touch as being read."""
        self._change(frame=frame, state="reading", moving=False)

    def conclude(self, answer: dict[str, Any], *, answered: bool) -> None:
        """Take the answer, or the refusal."""
        self._change(answer=answer, state="answered" if answered else "refused", moving=False)

    def move(self) -> None:
        """Mark the newest touch as different from what was read."""
        self._change(moving=True)

    def lift(self) -> None:
        """End the touch; one that was never read leaves no record."""
        with self._turn:
            held = self._records.get(self._number)
            if held is None or not held.contact:
                return
            if held.state == "felt":
                del self._records[held.number]
                held = replace(held, contact=False)
                self._broker.publish("touch", held.as_json() | {"dropped": True})
            else:
                self._put(replace(held, contact=False, moving=False))

    def newest_answer(self) -> dict[str, Any] | None:
        """Return what the newest touch was read as; None if it was not, or is no more."""
        with self._turn:
            held = self._records.get(self._number)
            return None if held is None else held.answer

    def all(self) -> list[dict[str, Any]]:
        """Return all records, oldest first."""
        with self._turn:
            return [record.as_json() for record in self._records.values()]

    def one(self, number: int) -> dict[str, Any]:
        """Return a record with its image, (rows, columns) counts."""
        with self._turn:
            record = self._known(number)
            return record.as_json() | {"counts": record.frame.counts.tolist()}

    def rename(self, number: int, name: str) -> dict[str, Any]:
        """Give a touch a name; `BenchError` for one that is too long."""
        if len(name) > NAME_LENGTH:
            raise BenchError(f"a name of {len(name)} characters",
                             fix=f"give at most {NAME_LENGTH}")  # fmt: skip
        with self._turn:
            record = replace(self._known(number), name=name)
            self._put(record)
            return record.as_json()

    def delete(self, number: int) -> None:
        """Forget a touch."""
        with self._turn:
            self._known(number)
            del self._records[number]
            self._publish_change()

    def frame(self, number: int) -> Frame:
        """Return the frame of a touch that was read."""
        with self._turn:
            return self._known(number).frame

    def frames(self, after: int = 0) -> list[Frame]:
        """Return the frames that were read of touches after a number, oldest first."""
        with self._turn:
            read = [one for one in self._records.values() if one.state != "felt"]
            return [one.frame for one in read if one.number > after]

    def as_csv(self) -> str:
        """Return a line for each touch."""
        text = io.StringIO(newline="")
        table = csv.writer(text, lineterminator="\r\n")
        table.writerow(COLUMNS)
        with self._turn:
            table.writerows(_row(record) for record in self._records.values())
        return text.getvalue()

    def _publish_change(self) -> None:
        """Let the pages ask for all records: one that is not the newest has changed."""
        self._changes += 1
        self._broker.publish("touches", {"changes": self._changes})

    def _known(self, number: int) -> TouchRecord:
        record = self._records.get(number)
        if record is None:
            raise UnknownError(f"there is no touch {number}", fix="it may have been deleted")
        return record

    def _change(self, **values: Any) -> None:
        with self._turn:
            held = self._records.get(self._number)
            if held is not None:
                self._put(replace(held, **values))

    def _put(self, record: TouchRecord) -> None:
        before = self._records.get(record.number)
        self._records[record.number] = record
        if record.number != self._number:
            self._publish_change()
        elif before is None or before.as_json() != record.as_json():
            self._broker.publish("touch", record.as_json())


#: Of the table, mm and degrees.
COLUMNS = (
    "touch", "name", "felt_ms", "time_s", "state", "object", "face", "x_mm", "y_mm",
    "theta_deg", "sigma_mm", "sigma_deg", "margin", "doubt", "reason", "sum_counts",
)  # fmt: skip


def _row(record: TouchRecord) -> list[Any]:
    answer = record.answer or {}
    place = answer.get("place") or {}
    return [
        record.number, record.name, round(record.felt_ms), round(record.frame.t_ns * 1e-9, 4),
        record.state, answer.get("object") or "", answer.get("face") or "",
        *(place.get(key, "") for key in COLUMNS[7:12]),
        *(answer.get(key, "") for key in ("margin", "doubt", "because")),
        int(record.frame.counts.sum()),
    ]  # fmt: skip
