"""Read a probe: a thread takes the bytes, the consumer takes trusted frames.

The thread starts the stream, starts it again after silence or a reboot, and opens the port
again after it went away. The buffer between the two is bounded: when the consumer is slow,
the oldest frame is dropped and counted; with `buffer=1` the newest wins. A recording waits
for its consumer instead, for it can. A frame reaches the consumer one frame later than it
came, when its neighbour has confirmed it (`probe.client.receiver`).
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Self

from encoded_objects.base.errors import EncodedObjectsError
from probe.client.receiver import ClientStatistics, Receiver
from probe.errors import PortError, ProbeError
from probe.frame import Frame
from probe.port.address import Port
from probe.port.url import address_of, open_port
from probe.protocol import (
    VERSION,
    Command,
    Damage,
    IdentPacket,
    StatisticsPacket,
    bits_command,
    sensor_command,
)

_BUFFER = 2048  #: frames, about 2 MB and 20 s
_SILENCE_S = 0.5  #: after so long without a packet the stream is started again
_IDENT_S = 2.0  #: for which the description of the probe is waited for
_ANSWER_S = 4.5  #: a probe that has a boot loader answers within 3; a person waits 5
_SLICE_S = 0.05  #: longest wait for bytes; a frame without successor is held so long
_GATHER_S = 0.006  #: pause after few bytes, so that each byte does not wake the thread
_FEW = 4096  #: bytes of one read, below which that pause is made
_SOFTWARE = ("sim:", "file:")  #: may pause for as long as they like
_NOTICES = 256  #: kept for whoever asks


class Client:
    """A conversation with a probe. Use it with `with`, and iterate over `frames()`.

    Parameters
    ----------
    url
        Of a port, see `probe.port.url`. It is opened at once.
    sensor, bits
        The sensor to select (0 ... 7) and the readings' width (8 or 10); as the device has
        them if not given. Both are sent again after a reboot.
    buffer
        Frames that wait for the consumer at most; 1: always the newest.
    reopen_s
        How long a port that went away is tried again before `frames` raises.
    answer_s
        How long a line may bring no trusted frame before `frames` raises.

    Raises
    ------
    PortError
        When the port cannot be opened.
    """

    def __init__(
        self,
        url: str,
        *,
        sensor: int | None = None,
        bits: int | None = None,
        buffer: int = _BUFFER,
        reopen_s: float = 30.0,
        answer_s: float = _ANSWER_S,
    ) -> None:
        if buffer < 1:
            raise PortError(f"a buffer of {buffer} frames, it holds at least 1", fix="take 1")
        self._sensor = b"" if sensor is None else sensor_command(sensor)
        self._bits = b"" if bits is None else bits_command(bits)
        self._buffer, self._reopen_s, self._answer_s = buffer, reopen_s, answer_s
        self._waits = url.startswith("file:")
        self._software = url.startswith(_SOFTWARE)
        self._shape: tuple[int, ...] = ()
        self._ready = threading.Condition()
        self._frames: deque[Frame] = deque()
        self._notices: deque[str] = deque(maxlen=_NOTICES)
        self._receiver = Receiver()
        self._reopenings = self._overruns = 0
        self._outbox = b""
        self._stop = threading.Event()
        self._ended = False
        self._failure: EncodedObjectsError | None = ProbeError(
            "reading ended by a fault of the programme"
        )
        self._port: Port = open_port(url)
        self._thread = threading.Thread(target=self._run, name=f"client of {url}", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def frames(self, timeout_s: float | None = None) -> Iterator[Frame]:
        """Yield trusted frames until the client is closed, or a recording ends.

        It ends, too, when no frame came for `timeout_s`. Raises PortError: nothing answers, or no
        frame that can be trusted; images of another shape; the port went away for good.
        """
        while True:
            with self._ready:
                self._ready.wait_for(lambda: self._frames or self._ended, timeout_s)
                if not self._frames:
                    if self._ended and self._failure is not None:
                        raise self._failure
                    return
                frame = self._frames.popleft()
                if self._waits:
                    self._ready.notify_all()
            yield frame

    def take(self, timeout_s: float) -> list[Frame]:
        """Return all frames that wait; none if none came in `timeout_s`, or at the end.

        Raises as `frames` does.
        """
        with self._ready:
            self._ready.wait_for(lambda: self._frames or self._ended, timeout_s)
            frames = list(self._frames)
            self._frames.clear()
            if not frames and self._ended and self._failure is not None:
                raise self._failure
            self._ready.notify_all()
        return frames

    @property
    def ended(self) -> bool:
        """Whether `take` will return no more frames, nor raise."""
        with self._ready:
            return self._ended and not self._frames and self._failure is None

    def notices(self) -> list[str]:
        """Return the events since the last call, in words: reboots, reopenings, silence."""
        with self._ready:
            notices = list(self._notices)
            self._notices.clear()
        return notices

    def statistics(self) -> ClientStatistics:
        """Return a snapshot of the counts."""
        with self._ready:
            return self._receiver.statistics(reopenings=self._reopenings, overruns=self._overruns)

    @property
    def ident(self) -> IdentPacket | None:
        """The description that the device sent; None before it did."""
        return self._receiver.ident

    @property
    def device(self) -> StatisticsPacket | None:
        """The counts of the device, after `ask_device`; None before it answered."""
        return self._receiver.device

    def wait_for_ident(self) -> IdentPacket | None:
        """Return the ident of the selected sensor, after a short wait; None if none came."""
        until_s = time.monotonic() + _IDENT_S
        while time.monotonic() < until_s:
            ident = self.ident
            if ident is not None and self._sensor in (b"", b"%d" % ident.sensor):
                break
            time.sleep(0.02)
        return self.ident

    def ask_device(self) -> None:
        """Ask the device for its statistics; the answer comes to `device`."""
        self._send(Command.STATISTICS)

    def select_sensor(self, sensor: int) -> None:
        """Read another sensor, 0 ... 7, from one of the next frames on."""
        self._sensor = sensor_command(sensor)
        self._send(self._sensor + Command.IDENT)

    def close(self) -> None:
        """Stop the stream and let go of the port; may be called twice."""
        self._stop.set()
        with self._ready:
            self._ready.notify_all()
        self._thread.join()

    # All below but `_send` runs in the thread.

    def _send(self, commands: bytes) -> None:
        with self._ready:
            self._outbox += commands

    def _run(self) -> None:
        try:
            with suppress(EOFError):
                self._converse()
            self._hand_on(self._receiver.settle(time.monotonic_ns()))
            self._failure = None
        except EncodedObjectsError as failure:
            self._failure = failure
        finally:
            self._leave()
            with self._ready:
                self._ended = True
                self._ready.notify_all()

    def _converse(self) -> None:
        self._send(self._greeting())
        heard_s = asked_s = opened_s = framed_s = time.monotonic()
        frames, before = 0, self._receiver.counts()
        while not self._stop.is_set():
            try:
                data = self._exchange()
            except PortError as gone:
                if time.monotonic() - framed_s > self._reopen_s + self._answer_s:
                    raise  # it opens, and breaks again and again
                self._reopen(gone)
                heard_s = asked_s = opened_s = time.monotonic()
                continue
            now_s, now_ns = time.monotonic(), time.monotonic_ns()
            if not data:
                self._hand_on(self._receiver.settle(now_ns))
            elif self._take(data, now_ns):
                heard_s = now_s
            # After a torn packet: a reset, whose ident was joined to what was being sent.
            since, torn = heard_s > asked_s, self._receiver.torn
            if now_s - max(heard_s, asked_s) > (_SLICE_S if since and torn else _SILENCE_S):
                if since and not torn:
                    self._tell(f"nothing came for {_SILENCE_S:g} s; the stream is started again")
                self._send(self._greeting())
                asked_s = now_s
            if self._receiver.frames > frames or (self._software and self._receiver.packets):
                frames, before, framed_s = self._receiver.frames, self._receiver.counts(), now_s
            elif now_s - max(framed_s, opened_s) > self._answer_s:
                came = self._receiver.counts()
                came.subtract(before)
                raise diagnose_silence(came, self._answer_s, self._port.url)
            if 0 < len(data) < _FEW:
                time.sleep(_GATHER_S)

    def _exchange(self) -> bytes:
        """Send the waiting commands; return the bytes that came."""
        if self._outbox:
            with self._ready:
                outbox, self._outbox = self._outbox, b""
            self._port.write(outbox)
        return self._port.read(_SLICE_S)

    def _take(self, data: bytes, now_ns: int) -> bool:
        """Take bytes; tell whether a packet was among them."""
        receiver = self._receiver
        packets, reboots, known = receiver.packets, receiver.reboots, receiver.ident is not None
        with self._ready:
            frames = receiver.feed(data, now_ns)
        if frames:
            self._hand_on(frames)
        if receiver.reboots > reboots:
            self._tell("the probe started anew")
        if receiver.reboots > reboots or (receiver.ident is not None and not known):
            self._send(self._sensor + self._bits + Command.START)
        return receiver.packets > packets

    def _hand_on(self, frames: list[Frame]) -> None:
        with self._ready:
            for frame in frames:
                self._shape = self._shape or frame.counts.shape
                if frame.counts.shape != self._shape:
                    raise PortError(
                        "its images changed from {} x {} to {} x {}".format(
                            *self._shape, *frame.counts.shape
                        ),
                        fix="start again, if another sensor was plugged in; or flash its firmware",
                        place=self._port.url,
                    )
                if self._waits:
                    self._ready.wait_for(
                        lambda: len(self._frames) < self._buffer or self._stop.is_set()
                    )
                elif len(self._frames) >= self._buffer:
                    self._frames.popleft()
                    self._overruns += 1
                self._frames.append(frame)
                self._ready.notify_all()

    def _reopen(self, gone: PortError) -> None:
        """Try the port again until it opens; the last refusal is the failure."""
        began_s = time.monotonic()
        self._hand_on(self._receiver.settle(time.monotonic_ns()))
        url = self._port.url
        self._port.close()
        self._tell(f"{gone.cause}; it is tried again for {self._reopen_s:g} s")
        pause_s = 0.05
        while not self._stop.wait(pause_s):
            try:
                self._port = open_port(url)
            except PortError as refused:
                if time.monotonic() - began_s > self._reopen_s:
                    raise PortError(
                        f"the probe went away and did not come back in {self._reopen_s:g} s: "
                        f"{refused.cause}",
                        fix=refused.fix,
                        place=url,
                    ) from refused
                pause_s = min(1.5 * pause_s, 0.5)
                continue
            self._reopenings += 1
            with self._ready:
                self._receiver.reopened()
            self._send(self._greeting())
            self._tell(f"the port is open again after {time.monotonic() - began_s:.1f} s")
            return

    def _leave(self) -> None:
        with suppress(PortError):  # when it is gone there is nothing to stop
            self._port.write(Command.STOP)
        self._port.close()

    def _greeting(self) -> bytes:
        return self._sensor + self._bits + Command.IDENT + Command.START

    def _tell(self, notice: str) -> None:
        with self._ready:
            self._notices.append(notice)


def diagnose_silence(came: Mapping[Damage | str, int], waited_s: float, url: str) -> PortError:
    """Return the error for a port that brought no trusted frame for so long, but `came`."""
    damaged = sum(came[kind] for kind in Damage)
    if came["packets"] and damaged:
        cause = f"{damaged} of {damaged + came['packets']} packets of the last {waited_s:g} s are "
        cause += f"damaged, and no image comes through ({_worst(came).value})"
        fix = "take a shorter cable away from motors, another USB port, or a lower baud rate"
    elif came["doubtful"]:
        cause = f"no image of the last {waited_s:g} s agrees with the next: they change their "
        cause += "shape, or go astray on the line"
        fix = "flash the firmware that belongs to this programme; then look at the cable"
    elif came["packets"]:
        cause = f"the probe answers, and sends no images for {waited_s:g} s"
        fix = "reset it, and see whether the sensor is plugged in"
    elif came[Damage.VERSION]:
        cause = f"the device speaks another version of the protocol, not {VERSION}"
        fix = "flash the firmware that belongs to this programme"
    elif damaged or came["bytes"]:
        cause = "what comes from the device are no packets of a probe"
        fix = "try another baud rate; if that does not help, it has not the probe's firmware"
    else:
        cause = f"the device was silent for {waited_s:g} s"
        fix = "try another baud rate, and see whether it has power and the probe's firmware"
    return PortError(cause, fix=fix, place=url)


def _worst(came: Mapping[Damage | str, int]) -> Damage:
    """Return the damage that is met most."""
    return max(Damage, key=lambda kind: came[kind])


def name_of(ident: IdentPacket | None, url: str) -> str:
    """Return how recordings and calibrations call the sensor that is read; empty: unknown.

    A recording that is played names the sensor that made it; RecordingError if it is gone.
    """
    address = address_of(url)
    if address.scheme == "file":
        from probe.recording.read import Recording

        return Recording(address.target).origin.sensor
    return "" if ident is None else f"{ident.name}/{ident.sensor}"
