"""Processor time of `probe-sensor record` and `live`: start-up, and share of a core after it.

    OPENBLAS_NUM_THREADS=1 python tests/bench/probe_command.py --seconds 12

Each command runs twice, for 4 s and for so much longer; the difference is the share, what is
left is the start. `sim` makes its frames in the same process; `avr` is the emulated firmware
in another one (188 frames a second at 1M baud), so that its line is the cost of reading alone.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import pty
import struct
import subprocess
import sys
import tempfile
import termios
import threading
from contextlib import suppress
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.emulated_probe import emulated_probe

COMMAND = (sys.executable, "-c", "from probe.command import main; main()")
SHORT_S = 4.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=12.0)
    options = parser.parse_args()
    print(f"{'port':<8}{'command':<18}{'% of a core':>12}{'start s':>9}")
    with emulated_probe() as probe, tempfile.TemporaryDirectory() as folder:
        probe.show(np.linspace(0, 4000, 256).reshape(16, 16))
        file = Path(folder) / "a.h5"
        for port, url in (("sim 220", "sim:?rate=220"), ("avr 188", probe.url)):
            for name, words, screen in (
                ("record", ("record", url, "-o", str(file), "--replace"), False),
                ("live, lines", ("live", url), False),
                ("live, terminal", ("live", url), True),
            ):
                short = cpu_s((*words, "--seconds", str(SHORT_S)), screen=screen)
                lasting = cpu_s(
                    (*words, "--seconds", str(SHORT_S + options.seconds)), screen=screen
                )
                share = (lasting - short) / options.seconds
                start_s = short - share * SHORT_S
                print(f"{port:<8}{name:<18}{100 * share:>12.1f}{start_s:>9.2f}")


def cpu_s(words: tuple[str, ...], *, screen: bool) -> float:
    """Run a command to its end, on a terminal of 100 x 30 or into nothing."""
    if screen:
        master, out = pty.openpty()
        fcntl.ioctl(out, termios.TIOCSWINSZ, struct.pack("4H", 30, 100, 0, 0))
    else:
        out = os.open(os.devnull, os.O_RDWR)
    process = subprocess.Popen([*COMMAND, *words], stdin=out, stdout=out, stderr=out,
                               env={**os.environ, "TERM": "xterm-256color"})  # fmt: skip
    os.close(out)
    if screen:
        threading.Thread(target=drained, args=(master,), daemon=True).start()
    _, _, usage = os.wait4(process.pid, 0)
    process.returncode = 0
    return usage.ru_utime + usage.ru_stime


def drained(master: int) -> None:
    """Take what is drawn, as a terminal does."""
    with suppress(OSError):
        while os.read(master, 65536):
            pass
    os.close(master)


if __name__ == "__main__":
    main()
