"""Whatever a file, a line or a page holds: it is read, or refused in words with its exit code.

The damage is that of `foreign`, by numbers; `tests/campaigns/fuzz.py` goes on where this ends.
"""

from __future__ import annotations

import io
import json
import sqlite3
import tempfile
import zipfile
from contextlib import closing
from functools import partial
from pathlib import Path

import foreign
import pytest
from foreign import case, databases, lines, page, recordings

from encoded_objects.base.errors import EncodedObjectsError
from probe.recording.ros import DEFINITIONS, IMAGE

CASES = {"command": 15, "step": 17, "database": 20, "import": 20, "3mf": 40, "array": 60}
CASES |= {"spec": 100, "recording": 100, "calibration": 100}
USUAL = 150  #: of other kinds


@pytest.fixture(scope="module")
def root():
    """A folder of cases; the page's session, if there is one, ends with it."""
    with tempfile.TemporaryDirectory(prefix="foreign-", dir=case.scratch()) as folder:
        yield Path(folder)
        while page.PAGE:
            page.PAGE.pop().close()


@pytest.mark.parametrize("kind", foreign.KINDS)
def test_what_comes_from_outside_is_read_or_refused(kind, root):
    foreign.prepare(kind, root)
    seen = set()
    for number in range(CASES.get(kind, USUAL)):
        outcome = foreign.attempt(kind, number, root)
        assert outcome.what not in case.FAULTS, (kind, number, outcome)
        seen.add(outcome.what)
    assert case.REFUSED in seen or kind in ("packets", "line")  # whose damage is counted


# -- what was found, each by its least case


def _mcap_with(more):
    from mcap_ros2.writer import Writer

    out = io.BytesIO()
    writer = Writer(out)
    writer._writer.add_metadata("recording", {"more": json.dumps(more)})
    schema = writer.register_msgdef(IMAGE, DEFINITIONS[IMAGE])
    writer.write_message("/t", schema, recordings.IMAGE_OF_ZEROS, log_time=5, sequence=0)
    writer.finish()
    return out.getvalue()


def _mcap_of_another_sum():
    """A file of ours whose first chunk says another check sum of what is in it."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    content = bytearray(recordings.mcap_file())
    records = StreamReader(io.BytesIO(content), emit_chunks=True).records
    chunk = next(one for one in records if isinstance(one, Chunk))
    at = content.index(chunk.uncompressed_size.to_bytes(8, "little")) + 8
    content[at] ^= 1
    return bytes(content)


def _mcap_of_another_type():
    """A file of ours whose summary names a type of messages otherwise."""
    content = bytearray(recordings.mcap_file())
    content[content.rindex(b"TouchFrame")] ^= 1
    return bytes(content)


def _lab_where(change):
    """A lab changed by SQL."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lab.db"
        path.write_bytes(databases.labs()["lab"])
        with closing(sqlite3.connect(path)) as base:
            base.execute("pragma foreign_keys = off")
            base.execute("pragma ignore_check_constraints = on")
            base.execute(change)
            base.commit()
        return path.read_bytes()


def _damaged(change, said="damaged", kind="database"):
    return kind, "lab.db", partial(_lab_where, change), said


def _packed_by_lzma():
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("a.gcode", "G1 X1 E1\n" * 99)
    content = bytearray(made.getvalue())
    content[60:90] = b"\xff" * 30
    return bytes(content)


LONG = "x" * 300
FOUND = {
    "half a letter": ("sensor type", "half.yaml", lambda: b'name: "\\ud800"\n', "half a letter"),
    "half a letter as a name": ("spec", "c.yaml", lambda: b'"\\ud800": 1\n', "half a letter"),
    "a name too long, of a spec": (
        "spec", "c.yaml", lambda: f"objects: [{LONG}.yaml]\n".encode(), "name too long",
    ),
    "an attribute that is nothing": ("mcap", "a.mcap", lambda: _mcap_with({"a": None}), "'a'"),
    "an attribute with a zero": ("mcap", "a.mcap", lambda: _mcap_with({"a": "b\0"}), "'a'"),
    "a chunk of another check sum": ("mcap", "a.mcap", _mcap_of_another_sum, "damaged"),
    "a summary of another check sum": ("mcap", "a.mcap", _mcap_of_another_type, "check sum"),
    "a plate packed by LZMA": ("3mf", "p.3mf", _packed_by_lzma, "no plate"),
    "glyphs that are a number": _damaged("update alphabets set definition = 0"),
    "no vertex of a face": _damaged("delete from faces_to_vertices"),
    **{
        f"{value} in {table}.{column}":
            _damaged(f'update or replace {table} set "{column}" = {value}', "never written")
        for table, columns, value in (
            ("placements", "rotation_rad x_mm y_mm", "'x'"),
            ("objects", "pitch_mm height_mm chamfer_mm", "'x'"),
            ("objects", "draft_rad height_mm", "1e6"),
            ("objects", "stroke_mm", "1e999"),
            ("arrays", "rows columns", "'x'"),
            ("arrays", "columns", "1e999"),
            ("arrays", "order", "-1"),
            ("cells", "x_mm label", "'x'"),
            ("faces", "object_id", "'x'"),
        )
        for column in columns.split()
    },
    "a pose that is no JSON": _damaged("update parts set T_object_part = '['", "be read", "import"),
}  # fmt: skip


@pytest.mark.parametrize("least", FOUND)
def test_what_was_found_is_refused(least, tmp_path):
    kind, name, content, said = FOUND[least]
    path, out = tmp_path / "in" / name, tmp_path / "out"
    path.parent.mkdir()
    out.mkdir()
    path.write_bytes(content())
    with pytest.raises(EncodedObjectsError) as caught:
        foreign.KINDS[kind].read((path, True) if kind == "mcap" else path, out)
    assert caught.value.exit_code in foreign.KINDS[kind].codes
    assert caught.value.fix
    assert said.lower() in caught.value.as_text().lower()


@pytest.mark.parametrize("url", [f"sim:?sensor_type={LONG}", f"file:{LONG}", f"serial:///{LONG}"])
def test_names_that_are_too_long_are_refused(url, tmp_path):
    with pytest.raises(EncodedObjectsError) as caught:
        lines.read_url(url, tmp_path)
    assert caught.value.exit_code in (2, 3)
