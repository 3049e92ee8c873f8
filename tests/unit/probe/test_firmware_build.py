"""The firmware builds for every board, and says what is missing when it cannot."""

import os
import shutil
import subprocess

import pytest

from probe.errors import PortError
from probe.firmware.build import BOARDS, SOURCES, build_emulator, build_firmware

RAM = {"uno": 2048, "mega": 8192, "teensy": 8192}
STACK = 512  # bytes that are left for it at least


@pytest.mark.parametrize("board", BOARDS)
def test_builds_without_a_warning_and_leaves_room_for_the_stack(board):
    folder = build_firmware(board=board)
    listing = subprocess.run(
        ["avr-size", folder / "probe.elf"], capture_output=True, text=True, check=True
    ).stdout
    text, data, bss = map(int, listing.splitlines()[1].split()[:3])
    assert data + bss <= RAM[board] - STACK
    assert text <= 16384
    assert (folder / "probe.hex").read_text().startswith(":")


def test_a_build_is_kept_and_needs_no_compiler_again(monkeypatch):
    first = build_firmware(), build_emulator()
    monkeypatch.setenv("PATH", "")
    assert (build_firmware(), build_emulator()) == first


def test_other_settings_are_another_build():
    assert build_firmware(settle_us=20) != build_firmware()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"baud": 115_200}, "115200 baud is not exact"),
        ({"settle_us": 64.0}, "settle for 64.0 us"),
        ({"settle_us": 0.1}, "settle for 0.1 us"),
        ({"settle_us": float("nan")}, "settle for nan us"),
        ({"settle_us": -1}, "settle for -1 us"),
        ({"board": "uno2"}, "no board 'uno2'"),
        ({"adc_divider": 8}, "16 MHz / 8"),
    ],
)
def test_impossible_settings_are_refused(settings, said):
    with pytest.raises(PortError, match="take") as refused:
        build_firmware(**settings)
    assert said in refused.value.cause


def test_make_itself_refuses_a_rate_that_is_not_exact(tmp_path):
    done = subprocess.run(
        ["make", "-C", SOURCES, f"OUT={tmp_path}", "BAUD=115200"], capture_output=True, text=True
    )
    assert done.returncode
    assert "BAUD is not exact at 16 MHz" in done.stderr


def test_a_missing_compiler_is_named_with_the_way_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(PortError, match=r"apt-get install .*gcc-avr") as missing:
        build_firmware()
    assert "make, avr-gcc, avr-objcopy not found" in str(missing.value)
    with pytest.raises(PortError, match=r"apt-get install .*libsimavr-dev"):
        build_emulator()


def test_a_missing_library_is_named_with_the_way_to_get_it(monkeypatch, tmp_path):
    compiler = tmp_path / "cc"  # the compiler, and a library that is nowhere
    compiler.write_text(f'#!/bin/sh\nexec {shutil.which("cc")} "$@" -lnot_there\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    with pytest.raises(PortError, match=r"-lnot_there(.|\n)*libsimavr-dev"):
        build_emulator()
    assert not list((tmp_path / "cache").rglob(".building-*"))
    assert not list((tmp_path / "cache").rglob("emulator"))


def test_a_cache_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    (tmp_path / "encoded-objects").write_text("a file where the folder should be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(PortError, match="XDG_CACHE_HOME"):
        build_emulator()
