"""The mosaics of the faces that were touched, as they grow. Thesis 4.3."""

from __future__ import annotations

import threading
from collections import OrderedDict

from encoded_objects.base.sensor_type import SensorType
from recognizer.bench.broker import Broker
from recognizer.bench.message import MosaicMessage, mosaic_message
from recognizer.bench.settings import RECOGNITION
from recognizer.scan.mosaic.grow import add_touch
from recognizer.scan.mosaic.mosaic import Mosaic, no_touches
from recognizer.scan.mosaic.planar import PlacedTouch, decoded_place
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal


class FaceMosaics:
    """A mosaic for each of the faces touched last; any thread may call."""

    def __init__(self, sensor: SensorType, broker: Broker) -> None:
        self._sensor, self._broker = sensor, broker
        self._turn = threading.Lock()
        self._mosaics: OrderedDict[tuple[str, str], Mosaic] = OrderedDict()

    def grow(self, answer: Recognition, signal: Signal) -> None:
        """Put an answered touch into the mosaic of its face, and tell the pages."""
        place = decoded_place(answer)
        if place is None or answer.object is None or answer.face is None:
            return
        key = (answer.object, answer.face)
        with self._turn:
            mosaic = self._mosaics.get(key) or no_touches(self._sensor)
        if len(mosaic) < RECOGNITION.touches:
            mosaic = add_touch(mosaic, PlacedTouch(signal, decoded=place, seq=answer.seq))
        with self._turn:
            self._mosaics[key] = mosaic
            self._mosaics.move_to_end(key)
            while len(self._mosaics) > RECOGNITION.faces:
                self._mosaics.popitem(last=False)
        of = {"object": key[0], "face": key[1], "touches": len(mosaic), "most": RECOGNITION.touches}
        self._broker.publish("mosaic-of", of)
        self._broker.publish("mosaic", mosaic_message(mosaic.image, len(mosaic)))

    def clear(self) -> None:
        """Forget them."""
        with self._turn:
            self._mosaics.clear()
        self._broker.publish("mosaic-of", {"object": None, "face": None, "touches": 0})
        self._broker.publish("mosaic", mosaic_message(no_touches(self._sensor).image, 0))

    def touches(self, object_name: str) -> dict[str, int]:
        """Return how many touches the mosaics of an object's faces hold, by face."""
        with self._turn:
            return {
                face: len(one) for (held, face), one in self._mosaics.items() if held == object_name
            }

    def picture(self, object_name: str, face: str) -> MosaicMessage | None:
        """Return the mosaic of a face; None where it was not touched."""
        with self._turn:
            mosaic = self._mosaics.get((object_name, face))
        return None if mosaic is None else mosaic_message(mosaic.image, len(mosaic))
