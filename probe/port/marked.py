"""A stream of images behind markers that may stand inside an image too.

Bytes in pieces of any size, and how long the line was quiet before each -> whole images. What
tells where an image begins is its length and the line's rate: markers stand an image apart, and
a board pauses between images. Where only one distance in the stream bears a marker every time it
is the true one; where an image that does not change holds the marker too, that one counts which
is nearest to where the line pauses.
"""

from __future__ import annotations

from probe.port.settings import PORT

MARKER = b"\xaa\x55"


class MarkedImages:
    """Images out of a stream; nothing is passed on whose next marker has not come.

    Parameters
    ----------
    length
        Bytes of an image, without its marker.
    """

    def __init__(self, length: int) -> None:
        self.sure = False  #: whether it is known where images begin
        self.lost = 0  #: bytes that belonged to no image
        self._step = len(MARKER) + length
        self._rest = bytearray()
        self._at = 0  # bytes that left `_rest`
        self._paused: list[int] = []  # where in the stream the line began again after a pause

    def feed(self, data: bytes, *, quiet_s: float = 0.0) -> list[bytes]:
        """Return the images that `data` completes.

        Parameters
        ----------
        quiet_s
            How long the line was seen empty before the first byte of `data`.
        """
        if data and quiet_s >= PORT.pause_least_s:
            self._paused = [*self._paused[1 - PORT.pauses :], self._at + len(self._rest)]
        self._rest += data
        images: list[bytes] = []
        while self.sure or self._find():
            if len(self._rest) < self._step + len(MARKER):
                break
            if self._marked(self._step):
                images.append(bytes(self._rest[len(MARKER) : self._step]))
                self._take(self._step)
                continue
            self.sure = False  # bytes of this image were lost, or came in between
            self._drop(len(MARKER))
        return images

    def _find(self) -> bool:
        """Go to where an image begins, and tell whether that is known."""
        needed = (PORT.marked_images + 1) * self._step + len(MARKER)  # for a start at any place
        while len(self._rest) >= needed:
            starts = [at for at in range(self._step) if self._marked_always(at)]
            if len(starts) > 1 and self._paused:
                starts = [min(starts, key=self._from_pause)]
            if len(starts) == 1:
                self._drop(starts[0])
                self.sure = True
                return True
            self._drop(self._step)
        return False

    def _marked_always(self, at: int) -> bool:
        return all(self._marked(at + k * self._step) for k in range(PORT.marked_images))

    def _marked(self, at: int) -> bool:
        return self._rest[at : at + len(MARKER)] == MARKER

    def _from_pause(self, at: int) -> int:
        """Return how many bytes a place lies from where the line pauses, image by image."""
        away = [(self._at + at - pause) % self._step for pause in self._paused]
        return sum(min(a, self._step - a) for a in away)

    def _drop(self, number: int) -> None:
        self.lost += number
        self._take(number)

    def _take(self, number: int) -> None:
        self._at += number
        del self._rest[:number]
