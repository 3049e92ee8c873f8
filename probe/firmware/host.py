"""The running emulator: a process that obeys lines and answers each with one line.

It ends with its standard input, so it cannot outlive the programme that started it.
"""

from __future__ import annotations

import os
import select
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from encoded_objects.base.cache import cache_folder
from probe.errors import PortError
from probe.firmware.settings import EMULATOR

_SHOWN = 500  # characters of its log


class Host:
    """A started emulator.

    Parameters
    ----------
    command
        Programme and arguments.
    log
        File for its messages.
    place
        Named in errors: the port that it offers.

    Raises
    ------
    PortError
        When it does not start.
    """

    def __init__(self, command: Sequence[str], log: Path, place: str) -> None:
        self._log = log
        self._place = place
        self._heard = b""
        self._process = _start_process(command, log)
        try:
            if self._answer() != "ready":
                raise self._ended()
        except BaseException:
            self.end()
            raise

    def ask(self, command: str) -> str:
        """Send a line and return the answer.

        Raises
        ------
        PortError
            When the emulator ended, or the command is no line.
        """
        assert self._process.stdin is not None
        if "\n" in command:
            raise PortError(f"{command!r} is more than one line", fix="give one command")
        try:
            self._process.stdin.write(command.encode() + b"\n")
        except (OSError, ValueError) as gone:
            raise self._ended() from gone
        return self._answer()

    def end(self) -> None:
        """End the emulator; may be called twice."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(EMULATOR.end_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        until = time.monotonic() + EMULATOR.answer_s
        while b"\n" not in self._heard:
            ready, _, _ = select.select([descriptor], [], [], max(until - time.monotonic(), 0))
            data = os.read(descriptor, 4096) if ready else b""
            if not data:
                raise self._ended()
            self._heard += data
        line, _, self._heard = self._heard.partition(b"\n")
        return line.decode()

    def _ended(self) -> PortError:
        said = self._log.read_text(errors="replace").strip() if self._log.exists() else ""
        return PortError(
            f"the emulator ended or does not answer: {said[-_SHOWN:] or 'it says nothing'}",
            fix="if libraries of the system changed, remove "
            f"{cache_folder('firmware')}: it is built anew",
            place=self._place,
        )


def _start_process(command: Sequence[str], log: Path) -> subprocess.Popen[bytes]:
    try:
        with log.open("wb") as messages:
            return subprocess.Popen(  # noqa: S603 - our own programme, no shell
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=messages,
                bufsize=0,
                process_group=0,  # an interrupt at the keyboard is for the client
            )
    except OSError as failed:
        raise PortError(
            f"{command[0]} cannot be started: {failed.strerror}",
            fix=f"remove {cache_folder('firmware')}",
        ) from failed
