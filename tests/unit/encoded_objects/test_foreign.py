"""Files of others: no regular file, too large, damaged; what is kept in the user's cache folder."""

import io
import os
import socket
import stat
import zipfile
from contextlib import chdir
from multiprocessing import get_context

import numpy as np
import pytest

from encoded_objects.base.cache import cache_folder, cached_bytes, content_key
from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.foreign import (
    foreign_bytes,
    foreign_json,
    foreign_member,
    open_regular,
    regular_size,
    run_limited,
)
from generator.database.open import open_database
from generator.errors import DatabaseError
from generator.polyhedron.read import read_shape
from generator.spec import read_specs
from probe.calibration import read_calibration
from probe.recording.imported import import_array
from probe.recording.read import Recording
from recognizer.sensor.file import read_state


@pytest.fixture
def odd(tmp_path):
    """Return what may stand where a file should be, by its name in messages."""
    os.mkfifo(tmp_path / "pipe")
    with chdir(tmp_path), socket.socket(socket.AF_UNIX) as bound:  # a socket's name is short
        bound.bind("socket")
    pipe, bound = tmp_path / "pipe", tmp_path / "socket"
    return {"a device": "/dev/zero", "a named pipe": pipe, "a socket": bound}


def linked(tmp_path, target, name):
    """Return a link of that name to what may have no suffix."""
    link = tmp_path / name
    link.unlink(missing_ok=True)
    link.symlink_to(target)
    return link


def test_only_regular_files_are_opened(odd, tmp_path):
    for open_it in (open_regular, regular_size):
        for name, path in odd.items():
            with pytest.raises(OSError, match=f"it is {name}, not a file"):
                open_it(path)
        with pytest.raises(OSError, match="Is a directory"):
            open_it(tmp_path)
    file = tmp_path / "a"
    file.write_bytes(b"12")
    with open_regular(linked(tmp_path, file, "link")) as opened:
        assert opened.read() == b"12"
    with pytest.raises(FileNotFoundError):
        open_regular(linked(tmp_path, tmp_path / "gone", "dangling"))


READERS = {
    "c.json": read_calibration,
    "s.json": read_state,
    "p.stl": read_shape,
    "p.obj": read_shape,
    "p.step": read_shape,
    "spec.yaml": lambda path: read_specs([path]),
    "t.h5": Recording,
    "t.csv": lambda path: import_array(path, path.with_name("out.h5")),
    "t.npz": lambda path: import_array(path, path.with_name("out.h5")),
    "lab.db": lambda path: open_database(str(path)),
}


@pytest.mark.parametrize("name", READERS)
def test_every_reader_refuses_what_is_no_file(name, odd, tmp_path):
    for kind, path in odd.items():
        link = linked(tmp_path, path, name)
        with pytest.raises(EncodedObjectsError) as refused:
            READERS[name](link)
        assert str(link) in refused.value.place
        assert kind in refused.value.cause
        assert refused.value.fix
        assert refused.value.exit_code == (4 if name == "lab.db" else 2)


def test_no_database_is_made_where_a_link_leads(tmp_path):
    link = linked(tmp_path, tmp_path / "elsewhere", "lab.db")
    with pytest.raises(DatabaseError, match="No such file"):
        open_database(str(link))
    assert not (tmp_path / "elsewhere").exists()


def test_size_is_asked_before_content(tmp_path):
    file = tmp_path / "large"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)
    said = "the file has 1048576 MB; 5 KiB are allowed"
    with pytest.raises(EncodedObjectsError, match=said) as refused:
        foreign_bytes(file, EncodedObjectsError, most=5000, fix="give another", large="less")
    assert (refused.value.place, refused.value.fix) == (str(file), "less")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, "[1", "\ud800", "9" * 5000])
def test_json_of_any_content_is_refused(text, tmp_path):
    file = tmp_path / "a.json"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(EncodedObjectsError, match="is no JSON"):
        foreign_json(file, EncodedObjectsError, fix="give another")


def test_a_member_unpacks_to_what_is_allowed():
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", bytes(10_000_000))
    archive = zipfile.ZipFile(packed)
    assert len(foreign_member(archive, "a", 10_000_000)) == 10_000_000
    with pytest.raises(ValueError, match="takes more than 8790 KiB"):
        foreign_member(archive, "a", 9_000_000)


def test_an_archive_that_claims_much_is_refused_before_a_value_is_read(tmp_path):
    for shape in ((2**40, 16, 16), (10**6, 16, 16)):
        head, said = io.BytesIO(), {"descr": "<u2", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(head, said)
        with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
            archive.writestr("frames.npy", head.getvalue())
        with pytest.raises(EncodedObjectsError, match="damaged"):
            import_array(tmp_path / "a.npz", tmp_path / "out.h5")
    content = bytearray((tmp_path / "a.npz").read_bytes())
    at = content.rindex(b"PK\1\2") + 24  # of the unpacked size in the directory
    content[at : at + 4] = (1 << 31).to_bytes(4, "little")
    (tmp_path / "b.npz").write_bytes(content)
    with pytest.raises(EncodedObjectsError, match="claims arrays of 2,147,483,648 bytes"):
        import_array(tmp_path / "b.npz", tmp_path / "out.h5")


def test_a_process_of_its_own_has_limits(tmp_path, monkeypatch):
    (tmp_path / "greedy.py").write_text(
        "import sys\n"
        "what = sys.argv[1]\n"
        "if what == 'memory': bytearray(1 << 30)\n"
        "if what == 'files': [open('/dev/null') for _ in range(100)]\n"
        "if what == 'room': open('out', 'wb').write(bytes(2_000_000))\n"
        "while what in ('time', 'ended'): pass\n"
        "print('done')\n"
    )
    asked = []

    def limited(what):
        limits = {"memory_bytes": 1 << 29, "cpu_s": 1, "written_bytes": 1_000_000}
        ending = (lambda: len(asked.append(1) or asked) > 5) if what == "ended" else lambda: False
        return run_limited("greedy", [what], ending=ending, **limits)

    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    for what in ("memory", "files", "room", "time", "ended"):
        code, printed = limited(what)
        assert code != 0, what
        assert printed == b"", what
    assert limited("nothing") == (0, b"done\n")


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


def test_nothing_is_kept_where_nothing_can_be_written_or_there_is_no_home(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    assert cached_bytes("kind", "key", lambda: b"1") == b"1"
    assert cached_bytes("kind", "key", lambda: b"2") == b"2"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr("pathlib.Path.home", lambda: (_ for _ in ()).throw(RuntimeError))
    assert cached_bytes("kind", "key", lambda: b"3") == b"3"


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
