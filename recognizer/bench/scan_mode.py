"""Touches fused into one belief while they come, and how that belief shrinks. Thesis 4.3, 6.3.

Topic `scan`: whether it is on, what all touches say together, and a step for each touch: in how
many places the probe may stand after it (the exponential of the belief's entropy), and the
likeliest of them; and how many registered places would match as well by chance.
"""

from __future__ import annotations

import math
import threading
from typing import Any

from encoded_objects.base.sensor_type import SensorType
from recognizer.bench.answers import answer_json
from recognizer.bench.broker import Broker
from recognizer.bench.settings import SCAN
from recognizer.scan.session import Scan
from recognizer.touch.reader import Reader
from recognizer.touch.signal import Signal


class ScanMode:
    """The belief of the touches since it was switched on; any thread may call."""

    def __init__(self, sensor: SensorType, broker: Broker) -> None:
        self._sensor, self._broker = sensor, broker
        self._turn = threading.Lock()
        self._scan: Scan | None = None
        self._on = False
        self._steps: list[dict[str, Any]] = []
        self._answer: dict[str, Any] | None = None
        self._tell()

    def switch(self, *, on: bool) -> None:
        """Begin anew, or end."""
        with self._turn:
            self._scan, self._on = None, on
            self._steps, self._answer = [], None
            self._tell()

    def add(self, reader: Reader, signal: Signal, number: int) -> None:
        """Take a touch that was read, if touches are fused."""
        with self._turn:
            if not self._on:
                return
            if self._scan is None:
                self._scan = Scan(reader)
            scan = self._scan
            answer = scan.add(signal, seq=number)
            self._answer = answer_json(answer, reader.lab, self._sensor)
            places = scan.places
            shares = [place.share for place in places]
            entropy = -sum(share * math.log(share) for share in shares if share > 0)
            self._steps.append(
                {
                    "touch": number,
                    "places": round(math.exp(entropy), 2) if places else None,
                    "likeliest": [
                        {"object": one.object, "face": one.face, "index": list(one.index),
                         "share": round(one.share, 4)}
                        for one in places[: SCAN.told]
                    ],
                    "answered": bool(answer),
                    "doubt": answer.doubt,
                }
            )  # fmt: skip
            del self._steps[: -SCAN.kept]
            self._tell()

    def _tell(self) -> None:
        scan = self._scan
        self._broker.publish(
            "scan",
            {
                "on": self._on,
                "touches": 0 if scan is None else scan.touches,
                "changes": 0 if scan is None else scan.changes,
                "answer": self._answer,
                "steps": self._steps,
            },
        )
