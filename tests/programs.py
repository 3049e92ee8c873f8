"""Commands of the project in processes of their own, for tests that watch them."""

import subprocess
import sys
import time
from contextlib import contextmanager

PATIENCE_S = 60.0  #: for anything, on a busy machine


def command(package, *words):
    """Return the words that run a command of a package: `probe`, `recognizer.validation`."""
    return [sys.executable, "-c", f"from {package}.command import main; main()", *map(str, words)]


@contextmanager
def started(package, *words, **named):
    """Start a command; it is gone when the block ends."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | named
    with subprocess.Popen(command(package, *words), **pipes) as process:
        try:
            yield process
        finally:
            process.kill()


def wait_for(holds, seconds=PATIENCE_S):
    """Return what `holds` returns, as soon as that is true."""
    end_s = time.monotonic() + seconds
    while not (found := holds()):
        assert time.monotonic() < end_s, "it takes too long"
        time.sleep(0.02)
    return found
