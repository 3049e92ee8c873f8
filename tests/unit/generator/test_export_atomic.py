"""All files or none: commit, leaving, interruption, and errors of the operating system."""

from __future__ import annotations

import hashlib
import os
import resource
import signal
import subprocess
import sys
import time

import pytest

from generator.errors import GeneratorError
from generator.export.atomic import Staging


def hidden(folder):
    return [path.name for path in folder.glob(".encode-object-*")]


def test_commit_moves_all_files_and_leaves_nothing_hidden(tmp_path):
    (tmp_path / "a.stl").write_bytes(b"old")
    with Staging(tmp_path) as staging:
        first = staging.write("a.stl", b"new")
        staging.write("b.step", (piece for piece in (b"one", memoryview(b"two"))), digest=True)
        assert (tmp_path / "a.stl").read_bytes() == b"old"
        assert not (tmp_path / "b.step").exists()
        committed = staging.commit()
    assert (tmp_path / "a.stl").read_bytes() == b"new"
    assert (tmp_path / "b.step").read_bytes() == b"onetwo"
    assert committed[0] == first
    assert committed[1].size == 6
    assert committed[0].sha256 == ""
    assert committed[1].sha256 == hashlib.sha256(b"onetwo").hexdigest()
    assert hidden(tmp_path) == []


def test_an_error_leaves_no_file_and_no_folder(tmp_path):
    folder = tmp_path / "out" / "cube"

    def pieces():
        yield b"abc"
        raise KeyError

    with pytest.raises(KeyError), Staging(folder) as staging:
        staging.write("a.stl", pieces())
    assert list(tmp_path.iterdir()) == []


_WRITER = """
import sys, time
from generator.export.atomic import Staging
with Staging(sys.argv[1]) as staging:
    staging.write("a.stl", b"x" * 100000)
    print("written", flush=True)
    time.sleep(60)
"""


def test_leftovers_of_a_killed_process_are_removed_and_those_of_a_living_one_kept(tmp_path):
    with subprocess.Popen(
        [sys.executable, "-c", _WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "written\n"
        left = hidden(tmp_path)
        assert len(left) == 1
        with Staging(tmp_path) as staging:
            assert left[0] in hidden(tmp_path)  # its owner is at work
            staging.write("b.stl", b"b")
            staging.commit()
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert hidden(tmp_path) == left
    assert not (tmp_path / "a.stl").exists()
    deadline = time.monotonic() + 10
    while hidden(tmp_path) and time.monotonic() < deadline:
        with Staging(tmp_path):
            pass
    assert hidden(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == ["b.stl"]


@pytest.mark.parametrize(
    ("name", "said", "fix"), [("a.stl", "Is a directory", ""), ("a" * 300, "too long", "shorter")]
)
def test_names_that_cannot_be_written(tmp_path, name, said, fix):
    (tmp_path / "a.stl").mkdir()
    with pytest.raises(GeneratorError, match=said) as caught, Staging(tmp_path) as staging:
        staging.write(name, b"")
    assert caught.value.place == str(tmp_path / name)
    assert fix in caught.value.fix
    assert [path.name for path in tmp_path.iterdir()] == ["a.stl"]


def test_a_folder_of_too_long_a_name_is_what_is_to_be_shorter(tmp_path):
    with pytest.raises(GeneratorError, match="too long") as caught, Staging(tmp_path / ("a" * 300)):
        pass
    assert caught.value.fix == "choose a folder of a shorter name with -o"


def test_no_room_for_the_file(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with (
            pytest.raises(GeneratorError, match="cannot write the file") as caught,
            Staging(tmp_path) as staging,
        ):
            staging.write("a.stl", (b"x" * 600 for _ in range(20)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)
    assert caught.value.place.endswith("a.stl")
    assert "-o" in caught.value.fix
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_may_not_be_written(tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        with pytest.raises(GeneratorError, match="Permission denied") as caught, Staging(folder):
            pass
    finally:
        if root:
            os.seteuid(0)
    assert caught.value.place == str(folder)
    assert "may write" in caught.value.fix
