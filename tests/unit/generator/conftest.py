"""A person who answers; places that are short of room or of rights."""

import os
import resource
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

COMMAND = (sys.executable, "-c", "from generator.command import main; main()")


@pytest.fixture
def answered():
    """Run `encode-object` at a terminal where a person types an answer."""

    def answered(answer, *words):
        ours, theirs = os.openpty()
        os.write(ours, answer.encode() + b"\n")
        given = {"stdin": theirs, "capture_output": True, "text": True, "timeout": 60}
        done = subprocess.run([*COMMAND, *words], **given)
        os.close(ours)
        os.close(theirs)
        return done

    return answered


@pytest.fixture
def unprivileged():
    """A folder of its own, seen as a person who is not root: root may write anywhere."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        root = os.geteuid() == 0
        if root:
            os.chown(folder, 65534, 65534)
            os.seteuid(65534)
        try:
            yield folder
        finally:
            if root:
                os.seteuid(0)
            folder.chmod(0o755)


@pytest.fixture
def room_for():
    """Return a context manager: no file grows beyond so many bytes."""

    @contextmanager
    def limited(most):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited
