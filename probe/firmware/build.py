"""Build the firmware and its emulator with make, each once.

A build is kept in the user's cache folder under a name made of its sources and settings, so
that a change of either makes a new build, and two programmes may build at the same time.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from encoded_objects.base.cache import cache_folder
from probe.errors import PortError

SOURCES = Path(__file__).parent
BOARDS = ("uno", "mega", "teensy")
BAUDS = (500_000, 1_000_000, 2_000_000)  #: exact at 16 MHz, and known to every terminal
LONGEST_SETTLING_US = 63.75
LINES_MAX = 16  #: rows or columns of the board
WIRINGS = ("grounded", "floating", "virtual")
"""Of the rows that are not read: at ground, or open; virtual: at ground, columns held at 0 V."""

PACKAGES = "apt-get install make gcc libc6-dev gcc-avr avr-libc libsimavr-dev libelf-dev"
_FIRMWARE_TOOLS = ("make", "avr-gcc", "avr-objcopy")
_HOST_TOOLS = ("make", "cc")
_SHOWN_LINES = 12


def build_firmware(
    *,
    board: str = "uno",
    baud: int = 1_000_000,
    settle_us: float = 10.0,
    adc_divider: int = 16,
    wiring: str = "grounded",
    shape: tuple[int, int] = (LINES_MAX, LINES_MAX),
) -> Path:
    """Return the folder with `probe.elf` and `probe.hex`.

    Parameters
    ----------
    board
        uno, mega or teensy.
    baud
        500,000, 1,000,000 or 2,000,000.
    settle_us
        us, 0 ... 63.75 in steps of 0.25: least time from switching a multiplexer to the
        conversion.
    adc_divider
        16, 32, 64 or 128: of 16 MHz, the clock of the ADC.
    wiring
        Of the rows that are not read: grounded, by shift registers, or floating; virtual is driven
        as grounded is.
    shape
        Rows and columns, 2 ... 16 each.

    Raises
    ------
    PortError
        When a setting is not possible, or the compiler is missing.
    """
    quarters = settle_us * 4
    if board not in BOARDS:
        raise PortError(f"there is no board {board!r}", fix=f"take one of {', '.join(BOARDS)}")
    if baud not in BAUDS:
        raise PortError(f"{baud} baud is not exact at 16 MHz", fix=f"take one of {BAUDS}")
    if not (0 <= settle_us <= LONGEST_SETTLING_US and quarters == int(quarters)):
        raise PortError(
            f"the firmware cannot settle for {settle_us} us",
            fix=f"take 0 ... {LONGEST_SETTLING_US} us in steps of 0.25 us",
        )
    if adc_divider not in (16, 32, 64, 128):
        raise PortError(
            f"the ADC cannot run at 16 MHz / {adc_divider}", fix="take 16, 32, 64 or 128"
        )
    if wiring not in WIRINGS:
        raise PortError(f"there is no wiring {wiring!r}", fix=f"take one of {', '.join(WIRINGS)}")
    if not all(2 <= lines <= LINES_MAX for lines in shape):
        raise PortError(
            f"a board of {shape[0]} x {shape[1]} tactels", fix=f"take 2 ... {LINES_MAX} of each"
        )
    driven = "floating" if wiring == "floating" else "grounded"
    settings = (f"BOARD={board}", f"BAUD={baud}", f"SETTLE={int(quarters)}",
                f"ADC_DIVIDER={adc_divider}", f"WIRING={driven}",
                f"ROWS={shape[0]}", f"COLUMNS={shape[1]}")  # fmt: skip
    sources = [*SOURCES.glob("*.[ch]"), *SOURCES.glob("boards/*.h")]
    return _build_cached("firmware", settings, sources, _FIRMWARE_TOOLS)


def build_emulator() -> Path:
    """Return the folder with the programme `emulator`.

    Raises
    ------
    PortError
        When the compiler or a library is missing.
    """
    return _build_cached("emulator", (), SOURCES.glob("emulator/*.[ch]"), _HOST_TOOLS)


def _build_cached(
    target: str, settings: Sequence[str], sources: Iterable[Path], tools: Sequence[str]
) -> Path:
    folder = cache_folder("firmware") / f"{target}-{_key(settings, sources)}"
    if folder.is_dir():
        return folder
    missing = [tool for tool in tools if shutil.which(tool) is None]
    if missing:
        raise PortError(f"{', '.join(missing)} not found, the emulated probe needs it",
                        fix=f"install it: {PACKAGES}")  # fmt: skip
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        fresh = tempfile.mkdtemp(prefix=".building-", dir=folder.parent)
    except OSError as refused:
        raise PortError(
            f"cannot write to {folder.parent}: {refused.strerror}",
            fix="set XDG_CACHE_HOME to a folder that can be written",
        ) from refused
    try:
        _make(target, settings, fresh)
        os.rename(fresh, folder)
    except OSError:
        if not folder.is_dir():  # otherwise another programme built the same meanwhile
            raise
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return folder


def _key(settings: Sequence[str], sources: Iterable[Path]) -> str:
    digest = hashlib.sha256(" ".join((platform.machine(), *settings)).encode())
    for source in sorted([*sources, SOURCES / "Makefile"]):
        digest.update(f"\0{source.relative_to(SOURCES)}\0".encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _make(target: str, settings: Sequence[str], out: str) -> None:
    command = ["make", "-s", "-C", str(SOURCES), f"OUT={out}", *settings, target]
    done = subprocess.run(  # noqa: S603 - our own Makefile, no shell
        command, capture_output=True, text=True, check=False
    )
    if done.returncode:
        said = "\n".join((done.stdout + done.stderr).strip().splitlines()[:_SHOWN_LINES])
        raise PortError(
            f"the {target} cannot be built:\n{said}\n",
            fix=f"if a header or a library is missing, install it: {PACKAGES}",
        )
