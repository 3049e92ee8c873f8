"""What is kept in the user's cache folder: the same bytes, few enough, never half a file."""

import os
import stat
from multiprocessing import get_context

import pytest

from encoded_objects.base.cache import cache_folder, cached_bytes, content_key


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def never():
    raise AssertionError("made again")


@pytest.mark.parametrize("damaged", [None, b"", b"abc", b"\0\0\0\0content"])
def test_made_once_and_again_where_it_is_deleted_or_damaged(damaged):
    assert cached_bytes("kind", "key", lambda: b"content") == b"content"
    assert cached_bytes("kind", "key", never) == b"content"
    file = cache_folder("kind") / "key"
    assert stat.S_IMODE(file.stat().st_mode) & 0o077 == 0  # its owner's alone
    file.unlink() if damaged is None else file.write_bytes(damaged)
    assert cached_bytes("kind", "key", lambda: b"content") == b"content"
    assert cached_bytes("kind", "key", never) == b"content"


def test_what_was_not_used_for_longest_goes():
    for age, key in ((3, "old"), (2, "used"), (1, "new")):
        cached_bytes("kind", key, lambda: bytes(100), largest=320)
        file = cache_folder("kind") / key
        os.utime(file, (file.stat().st_mtime - 100 * age,) * 2)
    cached_bytes("kind", "old", never)  # used now
    cached_bytes("kind", "newest", lambda: bytes(100), largest=320)
    assert {file.name for file in cache_folder("kind").iterdir()} == {"old", "new", "newest"}


def test_nothing_is_kept_where_nothing_can_be_written(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    assert cached_bytes("kind", "key", lambda: b"1") == b"1"
    assert cached_bytes("kind", "key", lambda: b"2") == b"2"


def test_no_home(monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("pathlib.Path.home", lambda: (_ for _ in ()).throw(RuntimeError))
    assert cached_bytes("kind", "key", lambda: b"1") == b"1"


def _use(number):
    for k in range(number, number + 40):
        content = bytes([k % 5]) * 50_000
        if cached_bytes("kind", f"{k % 5}", content.__bytes__, largest=120_000) != content:
            return False
    return True


def test_processes_side_by_side():
    with get_context("fork").Pool(4) as pool:
        assert all(pool.map(_use, range(8)))
    assert not list(cache_folder("kind").glob(".*"))


def test_key_tells_values_and_code_apart(tmp_path):
    code = tmp_path / "code.py"
    code.write_text("a = 1")
    keys = [content_key((1.0, "a"), [code]), content_key((1.5, "a"), [code]), content_key((1.0,))]
    code.write_text("a = 2")
    keys.append(content_key((1.0, "a"), [code]))
    assert len(set(keys)) == 4
    assert content_key((1.0, "a"), [code]) == keys[-1]
