"""Damaged files, packets and requests of every kind that is read, and what reading them must do.

    case = Case(kind, number)          the same number gives the same bytes
    outcome = attempt(kind, number, folder)

A `Kind` writes a thing that a number determines into a folder and reads it with the project's own
reader, in this process. Fine is what is read, or refused by an error of the project with a place,
a way out and the documented exit code. Everything else is a fault: `FAULTS`.

Damage is done to bytes (bits, blocks, numbers, the end) and to what they mean (types, shapes,
counts, links, names, keys, SQL, fields of packets and requests); a few of every kind of file are
no file at all (a folder, a fifo, a device, a link to itself).
"""

from __future__ import annotations

import asyncio
import io
import json
import os
import random
import resource
import shutil
import signal
import socket
import sqlite3
import struct
import tempfile
import time
import traceback
import warnings
import zipfile
from binascii import crc_hqx
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml
from cobs import cobs
from hostile_recordings import HOSTILE, write_hostile
from recorded import frames, pose_at, record, same

from encoded_objects.base.errors import EncodedObjectsError

TESTS = Path(__file__).parent
FIXTURES = TESTS.parent / "fixtures"
SECRET = b"kept to itself " * 80  #: of a file next to the folder that is given
LONGEST_S = 5.0  #: of a case
MOST_BYTES = 512 << 20  #: of memory that a case may take
BOMBS_MB = (64, 640)  #: what zips unpack to
ROOM = 3 << 29  #: bytes of addresses; what asks for more fails at once

READ, REFUSED = "read", "refused"
FAULTS = ("traceback", "wrong code", "no place", "hang", "memory", "left outside", "leak",
          "wrong value", "died")  # fmt: skip


class WrongValueError(AssertionError):
    """Something was read without a word that was never written."""


class LeftError(AssertionError):
    """Files of what was refused."""


class LeakError(AssertionError):
    """Bytes of another file were read, or something may lead there."""


class HangError(BaseException):
    """A case took longer than `LONGEST_S`."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case."""

    what: str  #: `READ`, `REFUSED`, or one of `FAULTS`
    detail: str = ""  #: where it went wrong, the same for the same fault
    seconds: float = 0.0
    megabytes: float = 0.0


@dataclass(frozen=True)
class Kind:
    """One kind of what comes from outside."""

    write: Callable[[random.Random, Path], Any]  #: into a folder; returns what is to be read
    read: Callable[[Any, Path], object]  #: it, with a folder for what comes of it
    codes: tuple[int, ...] = (2,)  #: exit codes of what is refused
    file: bool = True  #: a file is read, which may also be no file
    placed: bool = True  #: errors name the file
    longest_s: float = LONGEST_S
    most_bytes: int = MOST_BYTES
    sound: tuple[Callable[[], Any], ...] = ()  #: make what is damaged, once


# -- damage to bytes

EXTREMES = (0, 1, -1, 2**7, 2**8 - 1, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 10**9, 2**40,
            2**63 - 1, 2**63, 2**64 - 1)  # fmt: skip
WORDS = ("", " ", ".", "..", "../../secret.txt", "/etc/passwd", "a/b", "a\\b", "a\0b", "\ud800",
         "x" * 5000, "é" * 300, "\u202egnp.exe", "-", "nan", "NaN", "inf", "1e999", "0x10", "null",
         "~", "true", "60 mm", "-3 in", "12 deg", "\x1b[2J", "con", "CON.stl", "F1", "{}", "[]",
         "*", "%s", "'; drop table objects; --", "sqlite://", "file:",
         "http://127.0.0.1/")  # fmt: skip
NUMBERS = (0, -1, 1, 2, 3, 255, 256, 65_536, 10**9, 2**63, -(2**63) - 1, 10**400, 0.5, -0.0, 1e-320,
           1e308, float("nan"), float("inf"), float("-inf"))  # fmt: skip


def damaged(rng: random.Random, content: bytes) -> bytes:
    """Return the content with one to three places changed."""
    made = bytearray(content)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if not made:
            break
        at, length = rng.randrange(len(made)), min(rng.choice((1, 2, 4, 8, 64, 512)), len(made))
        other = rng.randrange(len(made) - length + 1)
        do = rng.randrange(9)
        if do in (0, 1):
            made[at] ^= 1 << rng.randrange(8)
        elif do == 2:
            made[at] = rng.randrange(256)
        elif do == 3:
            width = rng.choice((1, 2, 4, 8))
            number = rng.choice(EXTREMES) % 256**width
            at = at // width * width if rng.random() < 0.5 else at
            made[at : at + width] = number.to_bytes(width, rng.choice(("little", "big")))
        elif do == 4:
            del made[at:]
        elif do == 5:
            made[at : at + length] = bytes(len(made[at : at + length]))
        elif do == 6:
            at = min(at, len(made) - length)
            a, b = made[at : at + length], made[other : other + length]
            made[at : at + length], made[other : other + length] = b, a
        elif do == 7:
            made[at:at] = rng.choice((made[other : other + length], rng.randbytes(length)))
        else:
            del made[at : at + length]
    return bytes(made)


def damaged_text(rng: random.Random, text: str, splices: tuple[str, ...]) -> bytes:
    """Return text with pieces put in, taken out and doubled, or bytes damaged."""
    if rng.random() < 0.2:
        return damaged(rng, text.encode())
    for _ in range(rng.choice((1, 1, 2, 4))):
        at, removed = rng.randrange(len(text) + 1), rng.choice((0, 0, 1, 3, 40, len(text)))
        added = rng.choice((*splices, *splices, *WORDS, *map(str, NUMBERS[:14]), text[:60]))
        if rng.random() < 0.3:
            lines = text.split("\n")
            line = rng.randrange(len(lines))
            lines[line:line] = [lines[rng.randrange(len(lines))]] * rng.choice((1, 1, 50))
            text = "\n".join(lines)
        text = text[:at] + added + text[at + removed :]
    return text.encode("utf-8", "surrogatepass")


# -- damage to what is meant


def anything(rng: random.Random, depth: int = 0) -> Any:
    """Return any value that YAML and JSON can hold."""
    do = rng.randrange(8 if depth < 2 else 5)
    if do == 0:
        return rng.choice((None, True, False))
    if do in (1, 2):
        return rng.choice(NUMBERS)
    if do in (3, 4):
        return rng.choice(WORDS)
    some = range(rng.choice((0, 1, 2, 3)))
    if do == 5:
        return {rng.choice(WORDS): anything(rng, depth + 1) for _ in some}
    if do == 6:
        return [[] if depth else 0] * rng.choice((1, 1000))
    return [anything(rng, depth + 1) for _ in some]


def somewhere(rng: random.Random, value: Any) -> tuple[Any, Any] | None:
    """Return a random (holder, key) in nested lists and mappings; None in an empty one."""
    found = None
    while isinstance(value, dict | list) and value:
        key = rng.choice(list(value)) if isinstance(value, dict) else rng.randrange(len(value))
        found = value, key
        if rng.random() < 0.35:
            break
        value = value[key]
    return found


def mutated(rng: random.Random, value: Any) -> Any:
    """Return a copy of nested lists and mappings in which one to three things are others."""
    value = json.loads(json.dumps(value))
    for _ in range(rng.choice((1, 1, 2, 3))):
        found, other = somewhere(rng, value), somewhere(rng, value)
        if found is None or other is None:
            return anything(rng)
        holder, key = found
        do = rng.randrange(7)
        if do in (0, 1, 2):
            holder[key] = anything(rng)
        elif do == 3:
            del holder[key]
        elif do == 4:
            holder[key] = rng.choice(([holder[key]], {"value": holder[key]}, [holder[key]] * 2))
        elif do == 5 and isinstance(holder, dict):
            holder[rng.choice((*WORDS, "name", "version", "shape", "rows"))] = anything(rng)
        else:
            with suppress(KeyError, IndexError):
                holder[key] = json.loads(json.dumps(other[0][other[1]]))
    return value


def written_json(rng: random.Random, value: Any) -> bytes:
    """Return JSON, also as no one should write it: keys twice, deep, other encodings."""
    text = json.dumps(value, indent=rng.choice((None, 1)))
    do = rng.randrange(12)
    if do == 0 and isinstance(value, dict) and value:
        key = rng.choice(list(value))
        text = text.rstrip()[:-1] + f", {json.dumps(key)}: {json.dumps(anything(rng))}}}"
    elif do == 1:
        depth = rng.choice((100, 100_000))
        text = text.replace(rng.choice(("0", "null", "[")), "[" * depth + "]" * depth, 1)
    elif do == 2:
        return text.encode(rng.choice(("utf-16", "utf-8-sig", "latin-1", "utf-32")), "replace")
    elif do == 3:
        text = text.replace("1", "1" + "0" * 5000, 1)
    return text.encode("utf-8", "surrogatepass")


def written_yaml(rng: random.Random, value: Any) -> bytes:
    """Return YAML, also with what YAML can do to its reader."""
    text = yaml.safe_dump(value, sort_keys=False, allow_unicode=True)
    do = rng.randrange(12)
    if do == 0:
        bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
        for level in range(1, 9):
            bomb += f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 9)}]\n"
        text = bomb + text
    elif do == 1:
        text = "&a " + text if rng.random() < 0.5 else f"a: &a\n  b: *a\n{text}"
    elif do == 2:
        depth = rng.choice((60, 100_000))
        text += "deep: " + "[" * depth + "]" * depth + "\n"
    elif do == 3:
        text += f"{text.split(':')[0]}: {text.split(':')[0]}\n"
    elif do == 4:
        text += rng.choice(("x: !!python/object/apply:os.system [id]\n", "<<: {a: 1}\n", "? [a]\n",
                            "x: !!binary aGk=\n", "---\n" + text, "%TAG ! a:\n"))  # fmt: skip
    return text.encode("utf-8", "surrogatepass")


def no_file(rng: random.Random, path: Path) -> None:
    """Put something else than a file at a path."""
    path.unlink(missing_ok=True)
    do = rng.randrange(8)
    if do == 0:
        path.mkdir()
    elif do in (1, 2):
        os.mkfifo(path)
    elif do == 3:
        path.symlink_to("/dev/zero")
    elif do == 4:
        path.symlink_to(path.name)
    elif do == 5:
        path.symlink_to("/dev/" + rng.choice(("null", "full", "random")))
    elif do == 6:
        with closing(socket.socket(socket.AF_UNIX)) as line:
            before = Path.cwd()
            os.chdir(path.parent)
            line.bind(path.name)
            os.chdir(before)
    else:
        path.write_bytes(b"")


@cache
def bomb(megabytes: int, name: str, head: bytes) -> bytes:
    """Return a zip whose content is a thousand times as large."""
    made = io.BytesIO()
    with (
        zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open(name, "w") as out,
    ):
        out.write(head)
        for _ in range(megabytes):
            out.write(bytes(1 << 20))
    return made.getvalue()


# -- recordings

GOOD = 48  #: frames of the recordings


@cache
def _kept() -> tuple[Path, list[Any]]:
    """Return a folder of sound things, made once in a process and its children."""
    folder = Path(tempfile.mkdtemp(prefix="foreign-", dir=scratch()))
    given = frames(GOOD, pose=pose_at(3.0))
    return folder, given


@cache
def recordings() -> dict[str, bytes]:
    """Return recordings: of ours, of others, one that was not closed."""
    folder, given = _kept()
    ours = record(folder / "a.h5", given, sensor="mat 3").files[0].read_bytes()
    with h5py.File(folder / "b.h5", "w") as file:
        file["frames"] = np.stack([one.counts for one in given])
    from probe.recording.record import Recorder

    recorder = Recorder(folder / "c.h5", flush_s=0.0)
    with recorder:
        for frame in given:
            recorder.append(frame)
        journal = (folder / "c.part.h5").read_bytes()
    return {"ours": ours, "others": (folder / "b.h5").read_bytes(), "journal": journal}


ATTRIBUTES = ("format", "format_version", "tool_version", "sensor", "sensor_type", "calibration",
              "units", "piece", "scale", "scale_offset", "imported_from",
              "frame_bytes")  # fmt: skip
DATASETS = ("frames", "t_ns", "seq", "wrist", "pose")


def _odd_attribute(rng: random.Random) -> Any:
    return rng.choice((
        lambda: rng.choice([w for w in WORDS if "\0" not in w and "\ud800" not in w]),
        lambda: rng.choice([0, -1, 2**63 - 1, 10**9, 0.5, np.nan, np.inf, True]),
        lambda: np.bytes_(b"\xff\xfe\x80"), lambda: np.zeros(rng.choice((0, 1, 70))),
        lambda: np.array(["a", "b"], h5py.string_dtype()), lambda: h5py.Empty("f8"),
        lambda: np.zeros((), [("a", "i4"), ("b", "f8")]), lambda: np.complex128(1),
        lambda: np.array([1, 2], np.uint8), lambda: h5py.Reference(), lambda: "x" * 60_000,
        lambda: np.datetime64("2020-01-01").astype("i8"), lambda: np.bool_(False),
    ))()  # fmt: skip


def _odd_dataset(rng: random.Random, file: h5py.File, name: str) -> None:
    if name in file:
        del file[name]
    n = rng.choice((0, 1, GOOD - 1, GOOD, GOOD + 1, 2 * GOOD))
    shape = rng.choice(((), (n,), (n, 4), (n, 16, 16), (n, 4, 4), (n, 16, 16, 1), (n, 0, 16),
                        (n, 1, 1), (n, 255, 255), (2, n, 16), (0,), (n, 16, 17)))  # fmt: skip
    kind = rng.choice(("u1", "u2", ">u2", "i2", "i8", "u8", "f2", "f4", "f8", "c8", "?", "S5",
                       "text", "V3", "ref", "vlen", "enum", "pair", "array"))  # fmt: skip
    how = rng.choice(({}, {"chunks": True}, {"chunks": True, "compression": 9},
                      {"chunks": True, "fletcher32": True, "shuffle": True},
                      {"chunks": True, "scaleoffset": 3}, {"chunks": True, "compression": "lzf"},
                      {"maxshape": (None,) * len(shape)}))  # fmt: skip
    special = {"text": h5py.string_dtype(), "ref": h5py.ref_dtype, "vlen": h5py.vlen_dtype("i4"),
               "enum": h5py.enum_dtype({"a": 1}), "pair": np.dtype([("a", "u2"), ("b", "u2")]),
               "array": np.dtype(("u2", (2,)))}  # fmt: skip
    dtype = special.get(kind) or np.dtype(kind)
    fill = {}
    if kind in ("f2", "f4", "f8"):
        fill = {"fillvalue": rng.choice((0, np.nan, np.inf, -1, 0.5, 1e30))}
    elif kind in ("i2", "i8", "u8"):
        fill = {"fillvalue": rng.choice((0, 100, np.iinfo(kind).max, np.iinfo(kind).min))}
    with suppress(TypeError, ValueError, OSError, RuntimeError):
        file.create_dataset(name, shape, dtype, **how, **fill)


def _edit_hdf5(rng: random.Random, path: Path) -> None:
    with h5py.File(path, "r+") as file:
        for _ in range(rng.choice((1, 1, 2, 3))):
            name = rng.choice((*DATASETS, "extra"))
            do = rng.randrange(10)
            if do in (0, 1):
                with suppress(TypeError, ValueError, OSError, RuntimeError):
                    file.attrs[rng.choice(ATTRIBUTES)] = _odd_attribute(rng)
            elif do == 2 and len(file.attrs):
                file.attrs.pop(rng.choice(list(file.attrs)), None)
            elif do in (3, 4, 5):
                _odd_dataset(rng, file, name)
            elif do == 6 and name in file:
                del file[name]
            elif do == 7:
                if name in file:
                    del file[name]
                file[name] = rng.choice((
                    h5py.SoftLink("/" + rng.choice(DATASETS)), h5py.SoftLink(f"/{name}/{name}"),
                    h5py.ExternalLink("../secret.txt", "/"), h5py.ExternalLink("a.h5", "/frames"),
                ))  # fmt: skip
            elif do == 8:
                if name in file:
                    del file[name]
                source = h5py.VirtualSource(rng.choice((".", "../secret.txt", "a.h5")), "frames",
                                            (10**9, 16, 16))  # fmt: skip
                layout = h5py.VirtualLayout((10**9, 16, 16), "u2")
                layout[:] = source
                file.create_virtual_dataset(name, layout)
            else:
                if name in file:
                    del file[name]
                shape = rng.choice(((10**9, 16, 16), (4, 16, 16), (10**6, 16, 16), (1024,)))
                how = rng.choice(({"chunks": (64, 16, 16)[: len(shape)]},
                                  {"external": [("../secret.txt", 0, 1200)]}))  # fmt: skip
                with suppress(ValueError, OSError, RuntimeError):
                    file.create_dataset(name, shape, rng.choice(("u1", "u2")), **how)


def write_recording(rng: random.Random, folder: Path) -> tuple[Path, str, bool]:
    """Write a damaged recording; returns it, how to read it, whether only bytes were damaged."""
    how = rng.choice(("read", "read", "live", "repair", "import"))
    do = rng.random()
    if do < 0.08:
        path = folder / "a.h5"
        write_hostile(rng.choice([k for k in HOSTILE if k != "10,002 objects"]), path)
        return path, how, False
    of = rng.choice(("ours", "ours", "others", "journal"))
    path = folder / ("a.part.h5" if of == "journal" else "a.h5")
    content = recordings()[of]
    if of == "journal" or do < 0.5:
        path.write_bytes(damaged(rng, content))
        return path, rng.choice(("live", "repair")) if of == "journal" else how, of != "others"
    path.write_bytes(content)
    _edit_hdf5(rng, path)
    return path, how, False


def read_recording(given: tuple[Path, str, bool], out: Path) -> None:
    """Read all frames of a recording; bytes of ours are those that were recorded, or refused."""
    from probe.recording.imported import import_array
    from probe.recording.read import Recording
    from probe.recording.repair import repair

    path, how, whole = given
    if how == "repair":
        copy = out / path.name
        if path.is_file() and not path.is_symlink():
            shutil.copyfile(path, copy)
        else:
            copy = path
        read = Recording(repair(copy).path)
    elif how == "import":
        read = import_array(path, out / "b.h5")
    else:
        read = Recording(path, live=how == "live")
    str(read)
    known = {frame.seq: frame for frame in _kept()[1]}
    for frame in read.frames():
        image = frame.counts.astype("<u2").tobytes()
        if b"kept to" in image or b"kept to" in frame.counts.astype("u1").tobytes():
            raise LeakError("bytes of the secret in an image")
        true = known.get(frame.seq)
        if whole and how != "import" and (true is None or not same(frame, true)):
            raise WrongValueError(f"frame {frame.seq} of {path.name} ({how})")


# -- arrays of others


@cache
def arrays() -> dict[str, bytes]:
    """Return arrays of images in the files of numpy and MATLAB, and a table."""
    from scipy.io import savemat

    images = np.stack([one.counts for one in _kept()[1]]).astype(np.uint16)
    made: dict[str, bytes] = {}
    for name, save in (
        ("npy", lambda file: np.save(file, images)),
        ("npz", lambda file: np.savez_compressed(file, frames=images, more=np.arange(9))),
        ("mat", lambda file: savemat(file, {"frames": images.astype(float)})),
        ("csv", lambda file: np.savetxt(file, images[:9].reshape(9, -1), delimiter=",", fmt="%d")),
    ):
        buffer = io.BytesIO()
        save(buffer)
        made[name] = buffer.getvalue()
    return made


def _npy(rng: random.Random) -> bytes:
    shape = rng.choice(("(48, 16, 16)", "(10**9, 16, 16)", "(1000000000, 16, 16)", "(-1, 16, 16)",
                        "(16, 16)", "()", "(48,)", "(True, 16, 16)", "(4.5, 16, 16)", "None",
                        "(99999999999999999999, 16, 16)", "(0, 16, 16)",
                        "(16, 16, 48)"))  # fmt: skip
    kind = rng.choice(("'<u2'", "'>u2'", "'|O'", "'<f8'", "'<c16'", "'|S9'", "[('a', '<u2')]",
                       "'<M8[s]'", "'|b1'", "'<U3'", "'|V2'", "('<u2', (10**9,))",
                       "3"))  # fmt: skip
    order = rng.choice(("False", "True", "None", "2"))
    head = f"{{'descr': {kind}, 'fortran_order': {order}, 'shape': {shape}, }}"
    if rng.random() < 0.1:
        head = rng.choice(("", "{", "()" * 9000, "[" * 300, "{'a': 1}", "__import__('os')"))
    head += "\n"
    major = rng.choice((1, 2, 3, 9))
    length = struct.pack("<H" if major == 1 else "<I", min(len(head), 65535))
    body = np.full(48 * 256, rng.choice((0, 7, 65535)), "<u2").tobytes()[: rng.choice((1, 24576))]
    return b"\x93NUMPY" + bytes((major, 0)) + length + head.encode() + body


def write_array(rng: random.Random, folder: Path) -> Path:
    """Write a damaged array of images."""
    kind = rng.choice(("npy", "npz", "mat", "csv"))
    path = folder / f"a.{kind}"
    do = rng.random()
    content = damaged(rng, arrays()[kind])
    if kind == "csv" and do < 0.7:
        content = damaged_text(rng, arrays()[kind].decode(), (",", ";", '"', "\r", "\n", "nan,"))
    elif kind == "npy" and do < 0.6:
        content = _npy(rng)
    elif kind == "npz" and do < 0.05:
        head = _npy_head("(1000000, 16, 16)")
        content = bomb(rng.choice(BOMBS_MB), "frames.npy", head)
    elif kind == "npz" and do < 0.5:
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as archive:
            for _ in range(rng.choice((0, 1, 2))):
                name = rng.choice(("frames.npy", "../x.npy", "/tmp/x.npy", "a", "frames"))
                archive.writestr(name, _npy(rng))
        content = buffer.getvalue()
    elif kind == "mat" and do < 0.3:
        content = damaged(rng, arrays()["mat"][:128]) + arrays()["mat"][128:]
    path.write_bytes(content)
    return path


def _npy_head(shape: str) -> bytes:
    head = f"{{'descr': '<u2', 'fortran_order': False, 'shape': {shape}, }}\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode()


def read_array(path: Path, out: Path) -> None:
    """Import an array."""
    from probe.recording.imported import import_array

    for frame in import_array(path, out / "b.h5").frames():
        frame.counts.max()


# -- MCAP


@cache
def mcap_file() -> bytes:
    """Return a recording of ours as MCAP."""
    from probe.recording.mcap import export_mcap
    from probe.recording.read import Recording

    recordings()
    out = _kept()[0] / "a.mcap"
    export_mcap(Recording(_kept()[0] / "a.h5"), out)
    return out.read_bytes()


IMAGE_OF_ZEROS = {
    "header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "sensor"}, "height": 16, "width": 16,
    "encoding": "32FC1", "is_bigendian": 0, "step": 64, "data": bytes(1024),
}  # fmt: skip


def _odd_mcap(rng: random.Random) -> bytes:
    """Return a whole MCAP file whose messages say other things than they hold."""
    from mcap_ros2.writer import Writer

    from probe.recording.ros import DEFINITIONS, IMAGE, POSE, TOUCH_FRAME

    out = io.BytesIO()
    writer = Writer(out)
    more = rng.choice(("{}", "[]", "1", "null", "{", '{"piece": "a", "sensor": 3}', '"x"',
                       "[" * 100_000, '{"format": [], "a": {"b": NaN}}'))  # fmt: skip
    kind = rng.choice(("", "fsr-16", "name: x", "[", "&a"))
    said = {"sensor": rng.choice(WORDS[:5]), "units": "counts", "more": more,
            "calibration": "x", "sensor_type": kind}  # fmt: skip
    for _ in range(rng.choice((0, 1, 1, 2))):
        writer._writer.add_metadata("recording", said)
    image = IMAGE_OF_ZEROS
    touch = {"t_ns": 5, "seq": 1, "wrist": [0, 0, 0, 0], "has_pose": True,
             "pose": np.eye(4).ravel().tolist()}  # fmt: skip
    pose = {"header": image["header"], "pose": {"position": {"x": 0.0, "y": 0.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}}  # fmt: skip
    schemas = {kind: writer.register_msgdef(kind, DEFINITIONS[kind])
               for kind in (IMAGE, TOUCH_FRAME, POSE)}  # fmt: skip
    for number in range(rng.choice((0, 1, 3))):
        kind = rng.choice((IMAGE, IMAGE, IMAGE, TOUCH_FRAME, POSE))
        fields = dict({IMAGE: image, TOUCH_FRAME: touch, POSE: pose}[kind])
        name = rng.choice(list(fields))
        odd = {
            "height": [0, 1, 2**32 - 1, 17], "width": [0, 1, 2**32 - 1, 17], "step": [0, 63, 2**31],
            "encoding": ["", "mono8", "16UC1", "rgb8", "x" * 999], "is_bigendian": [1, 255],
            "data": [b"", bytes(1023), b"\xff" * 1024, np.full(256, np.nan, "f4").tobytes(),
                     np.full(256, 1e30, "f4").tobytes(), np.full(256, -1, "f4").tobytes()],
            "header": [{"stamp": {"sec": -(2**31), "nanosec": 2**32 - 1}, "frame_id": "é"}],
            "t_ns": [-(2**63), 2**63 - 1, 0], "seq": [-(2**63), 2**63 - 1, 1],
            "wrist": [[], [1], [65535] * 4, [0] * 9], "has_pose": [False],
            "pose": [[np.nan] * 16, [0.0] * 16, [1e308] * 16] if kind == TOUCH_FRAME else [
                {"position": {"x": np.nan, "y": 0.0, "z": 1e300},
                 "orientation": dict.fromkeys("xyzw", rng.choice((0.0, np.nan, 1e-320)))}],
        }  # fmt: skip
        fields[name] = rng.choice(odd[name])
        with suppress(Exception):  # the writer's own refusal
            writer.write_message("/t", schemas[kind], fields, log_time=5 + number, sequence=number)
        if rng.random() < 0.5:
            writer.write_message("/touch/image", schemas[IMAGE], image, log_time=9, sequence=9)
    writer.finish()
    return out.getvalue()


def write_mcap(rng: random.Random, folder: Path) -> tuple[Path, bool]:
    """Write a damaged MCAP file."""
    path = folder / "a.mcap"
    only_bytes = rng.random() < 0.6
    path.write_bytes(damaged(rng, mcap_file()) if only_bytes else _odd_mcap(rng))
    return path, only_bytes


def read_mcap(given: tuple[Path, bool], out: Path) -> None:
    """Import MCAP; its chunks have check sums."""
    from probe.recording.mcap import import_mcap

    path, only_bytes = given
    known = {frame.seq: frame for frame in _kept()[1]}
    for frame in import_mcap(path, out / "b.h5").frames():
        true = known.get(frame.seq)
        if only_bytes and (true is None or not same(frame, true)):
            raise WrongValueError("a frame that was not recorded")


# -- texts: calibration, sensor state, sensor type, printer, spec


def write_calibration(rng: random.Random, folder: Path) -> Path:
    """Write a damaged calibration."""
    text = (FIXTURES / "recordings" / "calibration.json").read_text()
    path = folder / "c.json"
    path.write_bytes(
        damaged_text(rng, text, ("[", "]", "{", "null,", '"', "NaN", "-"))
        if rng.random() < 0.3
        else written_json(rng, mutated(rng, json.loads(text)))
    )
    return path


@cache
def _true_calibration() -> str:
    document = json.loads((FIXTURES / "recordings" / "calibration.json").read_text())
    return str(document["sha256"])


def read_calibration(path: Path, _out: Path) -> None:
    """Read a calibration, whose sha256 is in it."""
    from probe.calibration.file import calibration_hash
    from probe.calibration.file import read_calibration as read

    if calibration_hash(read(path)) != _true_calibration():
        raise WrongValueError("a calibration that was changed")


@cache
def state_text() -> str:
    """Return the state of a sensor that was learned."""
    from recognizer.sensor.file import write_state as write
    from recognizer.touch.sensor_state import SensorState

    ones, flags = np.ones((16, 16)), np.zeros((16, 16), bool)
    pairs = np.full((16, 16, 2), 0.1)
    state = SensorState("mat 3", 40, False, flags, flags, 0 * ones, ones, ones, pairs, pairs)
    write(state, _kept()[0] / "s.json")
    return (_kept()[0] / "s.json").read_text()


def write_state(rng: random.Random, folder: Path) -> Path:
    """Write a damaged state of a sensor."""
    path = folder / "s.state.json"
    path.write_bytes(
        damaged_text(rng, state_text(), ("[", "]", "{", "null,", '"', "NaN", "-"))
        if rng.random() < 0.3
        else written_json(rng, mutated(rng, json.loads(state_text())))
    )
    return path


def read_state(path: Path, _out: Path) -> None:
    """Read a state, and say it as commands do."""
    from recognizer.sensor.file import read_state as read
    from recognizer.sensor.file import state_words

    state_words(read(path))


YAML_SPLICES = ("{", "}", "[", "]", ":", "- ", "\t", "\n", "'", '"', "#", "&a ", "*a", "!!int ",
                "|", "? ", "---\n", "...\n", "%YAML 1.2\n", "\x00", "\x85", "<<: ", "\u2028", "\r",
                "objects:", "{{{{{{", "file: c.yaml")  # fmt: skip


@cache
def texts(what: str) -> tuple[str, ...]:
    """Return sound files of people: `spec`, `printer`, `sensor`."""
    if what == "spec":
        return tuple(file.read_text() for file in sorted(FIXTURES.glob("**/*.yaml")))
    if what == "printer":
        limits = "stroke: 1 mm\ngap: 1 mm\nheight: 0.6 mm\nedge: 1 mm\noverhang: 45 deg\n"
        mine = f"like: prusa-mini\nname: mine\nnozzle: 0.6 mm\nbed: 180 x 180 mm\n{limits}"
        return (mine, "file: other.yaml\n")
    from encoded_objects.base.sensor_type_file import shipped_names, shipped_text

    return tuple(shipped_text(name) for name in shipped_names())


def _yaml_file(rng: random.Random, what: str) -> bytes:
    text = rng.choice(texts(what))
    if rng.random() < 0.4:
        return damaged_text(rng, text, YAML_SPLICES)
    return written_yaml(rng, mutated(rng, yaml.safe_load(text)))


def write_sensor_type(rng: random.Random, folder: Path) -> Path:
    """Write a damaged sensor type."""
    path = folder / f"mine-{rng.randrange(10**9)}.yaml"  # types are kept by their names
    path.write_bytes(_yaml_file(rng, "sensor"))
    return path


def read_sensor_type(path: Path, _out: Path) -> None:
    """Read a sensor type."""
    from encoded_objects.base.sensor_type_file import sensor_type_named

    sensor = sensor_type_named(str(path))
    if not 0 < sensor.rows * sensor.columns <= 255 * 255:
        raise WrongValueError(f"a matrix of {sensor.shape}")


def write_printer(rng: random.Random, folder: Path) -> Path:
    """Write a spec whose printer stands in a damaged file, which may name itself."""
    path = folder / "printer.yaml"
    do = rng.random()
    if do < 0.1:
        named = rng.choice(("printer.yaml", "./printer.yaml", "other.yaml", "..", "/dev/zero"))
        path.write_text(f"file: {named}\n")
        (folder / "other.yaml").write_text("file: printer.yaml\n")
    else:
        path.write_bytes(_yaml_file(rng, "printer"))
    spec = "name: Cube\nshape: {cube: 60 mm}\nprint: {printer: {file: printer.yaml}}\n"
    (folder / "c.yaml").write_text(spec)
    return path


def read_printer(path: Path, _out: Path) -> None:
    """Read the spec next to a printer's file."""
    from generator.spec import read_specs

    (spec,) = read_specs([path.parent / "c.yaml"])
    if not (spec.printer.layer_mm > 0 and min(spec.printer.bed_mm) > 0):
        raise WrongValueError(str(spec.printer))


def write_spec(rng: random.Random, folder: Path) -> Path:
    """Write a damaged spec, or set of specs, which may name itself, others and models."""
    path = folder / "c.yaml"
    do = rng.random()
    path.write_bytes(_yaml_file(rng, "spec"))
    if do < 0.15:
        entries = [rng.choice(("c.yaml", "a.yaml", "b.yaml", "..", "../secret.txt", "fifo.yaml",
                               "/dev/zero", "x" * 300 + ".yaml", {"name": "A", "shape": "b.stl"},
                               {"name": "Cube", "shape": {"cube": "60 mm"}}))
                   for _ in range(rng.choice((1, 2, 3)))]  # fmt: skip
        (folder / "a.yaml").write_bytes(path.read_bytes())
        (folder / "b.yaml").write_text("objects: [c.yaml, b.yaml]\n")
        os.mkfifo(folder / "fifo.yaml")
        path.write_bytes(written_yaml(rng, {"objects": entries}))
    elif do < 0.3:
        named = rng.choice(("m.stl", "m.step", "m.obj", "fifo.stl", "../secret.txt", ".", "m.tri",
                            "/dev/zero", "zero.stl"))  # fmt: skip
        (folder / "m.stl").write_bytes(damaged(rng, shapes(".stl")[0]))
        os.mkfifo(folder / "fifo.stl")
        (folder / "zero.stl").symlink_to("/dev/zero")
        path.write_text(f"name: M\nshape: {{file: {named}}}\n")
    return path


def read_spec(path: Path, _out: Path) -> None:
    """Read specs; what is wrong has places in the files, causes and ways out."""
    from generator.spec import SpecError, read_specs

    try:
        specs = read_specs([path])
    except SpecError as error:
        for problem in error.problems:
            mark = problem.mark
            lines = len(mark.source.lines) if mark else 0
            if not (problem.cause and problem.fix and problem.place) or (
                mark and not (1 <= mark.line <= lines + 1 and mark.column >= 1)
            ):
                raise WrongValueError(f"a problem without a place: {problem.cause[:60]}") from error
        raise
    for spec in specs:
        if not 0 < spec.style.pitch_mm < 1e4:
            raise WrongValueError(f"a pitch of {spec.style.pitch_mm}")


def read_by_command(path: Path, out: Path) -> None:
    """Encode a spec by the whole command; what is refused leaves nothing."""
    from generator.command import run

    os.chdir(out)
    said = io.StringIO()
    with redirect_stderr(said), redirect_stdout(io.StringIO()):
        code = run([str(path), "--format", "stl"])
    if code == 0:
        return
    error = EncodedObjectsError(said.getvalue(), fix="-", place=path.name)
    error.exit_code = code
    if not all(word in said.getvalue() for word in ("error: ", "fix: ")):
        error.fix = ""
    if code == 2 and any(out.iterdir()):
        raise LeftError(", ".join(one.name for one in out.iterdir()))
    raise error


# -- shapes


@cache
def shapes(suffix: str) -> tuple[bytes, ...]:
    """Return the models of the fixtures with this suffix."""
    return tuple(f.read_bytes() for f in sorted((FIXTURES / "shapes").glob(f"*{suffix}")))


def _triangles(rng: random.Random) -> bytes:
    content = bytearray(shapes(".stl")[0])
    count = (len(content) - 84) // 50
    for _ in range(rng.choice((1, 1, 3, count))):
        at = 84 + 50 * rng.randrange(count) + 12 + 4 * rng.randrange(9)
        number = rng.choice((np.nan, np.inf, 3e38, -3e38, 1e-45, 0.0, rng.uniform(-99, 99)))
        content[at : at + 4] = struct.pack("<f", number)
    if rng.random() < 0.3:
        content[80:84] = struct.pack("<I", rng.choice(EXTREMES) % 2**32)
    return bytes(content)


def _numbers_changed(rng: random.Random, text: str) -> str:
    """Return text in which some of its numbers are others."""
    words = text.split(" ")
    numbered = [i for i, word in enumerate(words) if any(c.isdigit() for c in word)]
    for i in rng.sample(numbered, min(len(numbered), rng.choice((1, 1, 3, 20)))):
        end = "\n" if words[i].endswith("\n") else ""
        words[i] = str(rng.choice((*NUMBERS, rng.uniform(-99, 99)))) + end
    return " ".join(words)


def _shape_writer(suffix: str) -> Callable[[random.Random, Path], Path]:
    splices = {
        ".stl": ("facet", "vertex 1 2", "endsolid", "\0", "solid", "nan"),
        ".obj": ("f 1 2 3\n", "f -1 -2 -3\n", "f 1/1/1 2//2 99\n", "v 1 2 nan\n", "v 1e999 0 0\n",
                 "f\n", "\\\n", "mtllib ../secret.txt\n", "f 0 0 0\n", "g x\n", "curv\n"),
        ".step": ("#1=", ");", "(", "*", "$", "'", "#99999999", "/*", "ENDSEC;", "#10=#10;",
                  "CARTESIAN_POINT('',(1E999,0.,0.))", "ADVANCED_FACE('',(),#1,.T.)"),
    }[suffix]  # fmt: skip

    def write(rng: random.Random, folder: Path) -> Path:
        path = folder / f"m{suffix}"
        content = rng.choice(shapes(suffix))
        do = rng.random()
        if suffix == ".stl" and do < 0.35:
            content = _triangles(rng)
        elif b"\0" in content or do < 0.5:
            content = damaged(rng, content)
        elif do < 0.75:
            content = _numbers_changed(rng, content.decode()).encode()
        else:
            content = damaged_text(rng, content.decode(), splices)
        path.write_bytes(content)
        return path

    return write


def read_model(path: Path, _out: Path) -> None:
    """Read a polyhedron."""
    from generator.polyhedron.read import read_shape

    solid = read_shape(path)
    if not (np.isfinite(solid.vertices).all() and len(solid.faces) >= 4):
        raise WrongValueError("a solid that is none")


def load_kernel() -> None:
    """Load the CAD kernel, before limits and forks."""
    import OCP.STEPControl  # noqa: F401


def read_model_in_fork(path: Path, out: Path) -> None:
    """Read a STEP model with the kernel in a fork of this process, which has it loaded."""
    from generator.polyhedron.read import kernel, step

    def run(_module: str, arguments: list[str], **_: object) -> tuple[int, bytes]:
        child = os.fork()
        if child == 0:
            code = 1
            with suppress(BaseException):
                for stream in (1, 2):
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
                kernel.main(*arguments)
                code = 0
            os._exit(code)
        try:
            status = os.waitpid(child, 0)[1]
        except BaseException:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise
        return os.waitstatus_to_exitcode(status), b""

    before = step.run_limited
    step.run_limited = run
    try:
        read_model(path, out)
    finally:
        step.run_limited = before


# -- G-code and 3MF


@cache
def gcodes() -> tuple[str, ...]:
    """Return G-code of several slicers."""
    folder = TESTS / "unit" / "generator" / "gcode"
    return tuple(file.read_text() for file in sorted(folder.glob("*.gcode")))


def write_3mf(rng: random.Random, folder: Path) -> Path:
    """Write damaged G-code, mostly as the plate in a 3MF."""
    path = folder / "p.gcode.3mf"
    do = rng.random()
    code = rng.choice(gcodes())
    lines = ("G1 X1e999 E1\n", "G1 X Y E1\n", "G2 X0 Y0 I0 J0 E1\n", "M82\n", "G1 E-1e308\n",
             "G92 E0\n", ";TYPE:x\n", "G2 X1 Y1 R1e-300 E9\n", "G1 Xnan E1\n", "G3 I1e12 J1 E1\n",
             ";WIDTH:nan\n", ";HEIGHT:-1\n", "M200 D0\n", "M221 S1e99\n")  # fmt: skip
    if do < 0.6:
        content = damaged_text(rng, code, lines)
    else:
        content = _numbers_changed(rng, code.replace("X", "X ").replace("X ", "X")).encode()
    if do < 0.3:
        path.write_bytes(content)
        return path
    if do < 0.34:
        head = gcodes()[0].encode()
        path.write_bytes(bomb(rng.choice(BOMBS_MB), "Metadata/plate_1.gcode", head))
        return path
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", rng.choice((0, 8, 8, 12, 14))) as archive:
        names = ("Metadata/plate_1.gcode", "../../x.gcode", "/x.gcode", "a.gcode/", "x" * 999,
                 ".gcode")  # fmt: skip
        for name in rng.sample(names, rng.choice((0, 1, 1, 2))):
            archive.writestr(name, content)
    path.write_bytes(damaged(rng, made.getvalue()) if do < 0.8 else made.getvalue())
    return path


def read_3mf(path: Path, _out: Path) -> None:
    """Read the moves of a plate, and lay its beads."""
    from generator.printed.deposit import beads_of
    from generator.printed.gcode import read_gcode

    beads_of(read_gcode(path))


# -- databases


@cache
def labs() -> dict[str, bytes]:
    """Return databases: a lab of a cube and a tag, and those of earlier versions."""
    from encoded_objects import encode

    folder = _kept()[0] / "lab"
    folder.mkdir(exist_ok=True)
    for spec in (
        "name: Cube\nshape: {cube: 60 mm}\n",
        "name: Box\nshape: {box: 40 x 30 x 20 mm}\n",
    ):
        encode(spec, database=str(folder / "lab.db"), folder=folder, formats=("stl",))
    kept = {"lab": (folder / "lab.db").read_bytes()}
    for version in ("v1", "v2"):
        kept[version] = (FIXTURES / "database" / f"{version}.db").read_bytes()
    return kept


def _sql(rng: random.Random, path: Path) -> None:
    """Change a database as no writer of ours would."""
    with closing(sqlite3.connect(path)) as base:
        base.execute("PRAGMA foreign_keys = OFF")
        named = "select name from sqlite_master where type = 'table' order by 1"
        tables = [row[0] for row in base.execute(named) if not row[0].startswith("sqlite")]
        for _ in range(rng.choice((1, 1, 2, 3))):
            table = rng.choice(tables)
            columns = [row[1] for row in base.execute(f"pragma table_info({table})")]
            if not columns:
                continue
            column, value = rng.choice(columns), anything(rng, 2)
            if isinstance(value, int) and not -(2**63) <= value < 2**63:
                value = 2**63 - 1
            if isinstance(value, str):
                value = value.encode("utf-8", "replace").decode()
            value = rng.choice((value, value, b"\xff\0", json.dumps(anything(rng)), "0" * 70_000))
            where = rng.choice(("", f" where rowid % {rng.choice((2, 3, 7))} = 0", " limit 1"))
            with suppress(sqlite3.Error):
                do = rng.randrange(12)
                if do < 6:
                    if where == " limit 1":
                        where = f" where {column} = (select {column} from {table} limit 1)"
                    base.execute(f"update {table} set {column} = ?{where}", (value,))
                elif do == 6:
                    base.execute(f"delete from {table}" + where.replace(" limit 1", ""))
                elif do == 7:
                    base.execute(f"drop table {table}")
                elif do == 8:
                    base.execute(f"alter table {table} rename column {column} to other")
                else:
                    base.execute(rng.choice((
                        f"alter table {table} rename to gone",
                        "create view extra as select * from extra",
                        f"create trigger t after insert on {table} begin select 1; end",
                        "update sqlite_master set sql = 'x'", "pragma user_version = 999",
                        "update meta set value = '99' where key = 'schema_version'",
                        "update meta set value = '0' where key = 'schema_version'",
                        "update meta set value = '../x' where key = 'lab_key'",
                        "create table sqlite (a)",
                        *(f"update objects set name = '{name}'" for name in ("../x", "a/b", "..")),
                        *(f"update parts set file = '{file}'" for file in (
                            "../../secret.txt", "/etc/passwd", "lab.db", "../../../x.stl")),
                    )))  # fmt: skip
        if rng.random() < 0.1:
            base.execute("pragma writable_schema = on")
            base.execute("update sqlite_master set sql = replace(sql, ?, ?)", rng.choice((
                ("INTEGER", "BLOB"), ("NOT NULL", ""), ("CREATE TABLE", "CREATE VIEW"), ("(", "((")
            )))  # fmt: skip
        base.commit()


def write_database(rng: random.Random, folder: Path) -> Path:
    """Write a damaged database."""
    path = folder / "lab.db"
    content = labs()[rng.choice(("lab", "lab", "lab", "v1", "v2"))]
    if rng.random() < 0.5:
        path.write_bytes(damaged(rng, content))
    else:
        path.write_bytes(content)
        with suppress(sqlite3.Error):
            _sql(rng, path)
    if rng.random() < 0.1:
        (folder / f"lab.db-{rng.choice(('wal', 'journal', 'shm'))}").write_bytes(rng.randbytes(999))
    return path


def read_database(path: Path, _out: Path) -> None:
    """Read all that a command, a page and a reader of touches read of a database."""
    from generator.database.open import open_database
    from generator.database.read import list_objects, read_object, read_parts
    from generator.database.transaction import read_transaction
    from recognizer.touch.lab import open_lab

    with read_transaction(open_database(str(path), writable=False)) as connection:
        for entry in list_objects(connection):
            read_object(connection, entry.name)
            read_parts(connection, entry.object_id)
    for array in open_lab(str(path)).arrays:
        for number in range(len(array.faces)):
            array.face(number)


def read_exchange(path: Path, out: Path) -> None:
    """Import a database into a new one; its names and parts must be as a spec's are."""
    from generator.database.exchange import import_objects
    from generator.database.open import open_database, part_path
    from generator.database.read import list_objects, read_object, read_parts
    from generator.database.transaction import read_transaction
    from generator.errors import DatabaseError
    from generator.spec.settings import object_name

    home = out / "home.db"
    import_objects(str(home), str(path))
    engine = open_database(str(home), writable=False)
    with read_transaction(engine) as connection:
        for entry in list_objects(connection):
            try:
                object_name(entry.name)
            except ValueError as bad:
                raise WrongValueError(f"an object called {entry.name[:40]!r}") from bad
            try:
                read_object(connection, entry.name)
                read_parts(connection, entry.object_id)
            except (ValueError, TypeError, LookupError, DatabaseError) as bad:
                raise WrongValueError(f"what was imported cannot be read: {bad!r:.60}") from bad
            for part in read_parts(connection, entry.object_id):
                if not part_path(engine.url, part.file).is_relative_to(path.parent):
                    raise LeakError("a part outside the folder of the file")


# -- the serial line


def _packet(rng: random.Random, number: int) -> bytes:
    """Return a packet with a right check sum whose fields may be anything."""
    from probe.protocol import FramePacket, IdentPacket, StatisticsPacket, encode

    frame = _kept()[1][number % GOOD]
    do = rng.random()
    if do < 0.8:
        counts = frame.counts
        return encode(FramePacket(number % 65536, number * 4545 % 2**32, counts, frame.wrist))
    if do < 0.86:
        return encode(IdentPacket(number % 65536, number * 4545 % 2**32))
    if do < 0.9:
        return encode(StatisticsPacket(number % 65536, number * 4545 % 2**32, 1, 2, 3, 4))
    rows, columns = rng.choice(((16, 16), (0, 0), (255, 255), (1, 1), (0, 16), (16, 0), (16, 17)))
    head = struct.pack(
        "<BBHI",
        rng.choice((*b"FBIS", 0, 255)),
        rng.choice((1, 2, 2, 2, 3, 255)),
        rng.choice((number % 65536, 0, 65535)),
        rng.choice((0, 2**32 - 1, 4545)),
    )
    body = bytes((rows, columns)) + rng.choice(
        (b"", bytes(rows * columns * 2 + 8), bytes(520), b"\xff" * 520, bytes(range(22)), bytes(14))
    )
    if rng.random() < 0.3:
        body = bytes((rows, columns, rng.choice((0, 7, 16, 17, 255)), 1, 0, 1, 1, 1)) + struct.pack(
            "<2H8s", 1, rng.choice((0, 7)), rng.choice((b"probe   ", b"\xff" * 8, b"\0\x1b[2J   "))
        )
    payload = head + body
    return cobs.encode(payload + struct.pack("<H", crc_hqx(payload, 0xFFFF))) + b"\0"


def write_packets(rng: random.Random, _folder: Path) -> tuple[list[bytes], set[int]]:
    """Return pieces of a stream with damage, and the numbers of frames that may come of it."""
    stream = [_packet(rng, number) for number in range(rng.choice((3, 12, 40)))]
    for _ in range(rng.choice((0, 1, 3))):
        at = rng.randrange(len(stream))
        do = rng.randrange(5)
        if do < 3:
            stream[at] = damaged(rng, stream[at])
        elif do == 3:
            stream.insert(at, rng.choice((rng.randbytes(99), bytes(50), b"\xff" * 9000)))
        else:
            del stream[at : at + rng.choice((1, 5))]
        if not stream:
            break
    whole, pieces = b"".join(stream), []
    while whole:
        size = rng.choice((1, 7, 100, 536, 4096))
        pieces.append(whole[:size])
        whole = whole[size:]
    return pieces, set()


def read_packets(given: tuple[list[bytes], set[int]], _out: Path) -> None:
    """Receive a stream; what is handed on is what was sent, pixel for pixel."""
    from probe.client.receiver import Receiver

    receiver, now = Receiver(), 0
    for piece in given[0]:
        now += 10**7
        for frame in (
            *receiver.feed(piece, now),
            *(receiver.settle(now) if len(piece) == 7 else ()),
        ):
            if frame.counts.shape == (16, 16) and frame.counts.max() > 0:
                true = _kept()[1][frame.seq % 65536 % GOOD]
                if not (frame.counts == true.counts).all() and frame.counts.max() < 1023:
                    raise WrongValueError("a frame that was not sent")
    receiver.statistics()


def write_line(rng: random.Random, _folder: Path) -> list[bytes]:
    """Return what a board says that has no check sums: images between markers."""
    images = [b"\xaa\x55" + one.counts.astype(np.uint8).tobytes() * 2 for one in _kept()[1][:20]]
    whole = damaged(rng, b"".join(images) * rng.choice((1, 2)))
    return [whole[at : at + 700] for at in range(0, len(whole), 700)]


def read_line(pieces: list[bytes], _out: Path) -> None:
    """Find images between markers."""
    from probe.port.flexitac import MarkedImages

    images = MarkedImages(512)
    for number, piece in enumerate(pieces):
        for image in images.feed(piece, quiet_s=0.001 * (number % 2)):
            if len(image) != 512:
                raise WrongValueError("an image of another length")


def write_url(rng: random.Random, folder: Path) -> str:
    """Return the URL of a port that cannot be meant, or hardly."""
    (folder / "a.h5").write_bytes(recordings()["ours"])
    (folder / "m.stl").write_bytes(shapes(".stl")[0])
    path = folder / "odd"
    no_file(rng, path)
    sane = {"file": str(folder / "a.h5"), "sim": rng.choice(("", str(folder / "m.stl"))),
            "serial": str(path), "flexitac": str(path)}  # fmt: skip
    options = {"rate": "100", "speed": "0", "loop": "0", "baud": "1000000", "noise": "1",
               "sensor_type": "fsr-16", "sensor": "0", "seed": "1", "force": "20",
               "": ""}  # fmt: skip
    scheme = rng.choice(("file", "file", "sim", "sim", "serial", "flexitac"))
    target, name = sane[scheme], rng.choice(list(options))
    value, query, stroke = options[name], rng.choice(("", "?{0}={1}")), rng.choice(("", "", "//"))
    do = rng.randrange(5)
    if do == 0:
        target = rng.choice((str(path), "", "//", "#", "a#b", str(folder), "../secret.txt", *WORDS))
    elif do in (1, 2):
        query = "?{0}={1}"
        value = rng.choice(("0", "-1", "1e9", "1e999", "nan", "1e-9", "no-such", *WORDS))
    elif do == 3:
        query = rng.choice(("?{0}", "?{0}={1}&{0}={1}", "?", "??", "?x={1}", "?={1}", "&{0}={1}"))
    else:
        scheme = rng.choice((scheme, scheme, "touch", "http", "", "x", "FILE", "file ", "\0"))
    return f"{scheme}:{stroke}{target}{query.format(name, value)}"


def read_url(url: str, _out: Path) -> None:
    """Open a port and read a little."""
    from probe.port.url import open_port, typed_port

    typed_port(url)
    port = open_port(url)
    try:
        with suppress(EOFError):
            for _ in range(3):
                port.read(0.01)
    finally:
        port.close()


# -- the page


class Page:
    """The application of a session behind its guard, asked without a server."""

    def __init__(self, folder: Path) -> None:
        from encoded_objects.base.sensor_type import SensorType
        from recognizer.bench.app import application
        from recognizer.bench.broker import Broker
        from recognizer.bench.guard import RequestGuard, access_rules
        from recognizer.bench.routes import api_routes
        from recognizer.bench.session import Session

        folder.mkdir()
        (folder / "secret.txt").write_bytes(SECRET)
        (folder / "lab.db").write_bytes(labs()["lab"])
        for name in (_kept()[0] / "lab").glob("*.stl"):
            shutil.copyfile(name, folder / name.name)
        (folder / "recordings").mkdir()
        (folder / "recordings" / "a.h5").write_bytes(recordings()["ours"])
        calibration = (FIXTURES / "recordings" / "calibration.json").read_bytes()
        (folder / "recordings" / "c.json").write_bytes(calibration)
        (folder / "recordings" / "link.h5").symlink_to("../secret.txt")
        (folder / "recordings" / "s.state.json").write_text(state_text())
        broker = Broker()
        self.session = Session(str(folder / "lab.db"), folder / "recordings", SensorType(), broker)
        app = application(self.session, broker, (("sim:touch", "simulated"),), None)
        self.session.open("sim:touch")
        made = [*api_routes(self.session, (), None).routes, *app.routes]
        self.routes = [(one.path, sorted(getattr(one, "methods", None) or ["GET"]))
                       for one in made if hasattr(one, "path")]  # fmt: skip
        self._app = RequestGuard(app, access_rules("127.0.0.1", ""))
        self._loop = asyncio.new_event_loop()
        self._life = app.router.lifespan_context(app)
        self._loop.run_until_complete(self._life.__aenter__())

    def ask(self, scope: dict[str, Any], bodies: list[Any]) -> list[dict[str, Any]]:
        """Return the messages of the answer."""
        sent: list[dict[str, Any]] = []
        kind = scope["type"]
        coming = list(bodies)

        async def receive() -> dict[str, Any]:
            if coming:
                return coming.pop(0)
            if kind == "websocket":
                await asyncio.sleep(0.02)
            elif bodies[-1].get("more_body") is not True:  # the asker stays for the answer
                await asyncio.Event().wait()
            return {"type": f"{kind}.disconnect", "code": 1001}

        async def send(message: Any) -> None:
            sent.append(dict(message))

        self._loop.run_until_complete(asyncio.wait_for(self._app(scope, receive, send), LONGEST_S))
        return sent

    def close(self) -> None:
        """End the session."""
        self._loop.run_until_complete(self._life.__aexit__(None, None, None))
        self._loop.close()
        self.session.close()


BODIES: dict[str, Any] = {
    "/api/port": {"url": "sim:touch", "sensor": 0}, "/api/sensor": {"sensor": 0},
    "/api/bias": {"on": True}, "/api/record": {"on": False}, "/api/scan": {"on": True},
    "/api/replay": {"name": "a.h5", "playing": True, "speed": 1.0, "at_s": 0.0},
    "/api/calibration": {"do": "begin", "newtons": [1.0, 2.0], "seconds": 1.0, "name": "c.json"},
    "/api/flip": {"changes": "columns"}, "/api/learned": {"do": "use", "name": "s.state.json"},
    "/api/mounting": {"touch": 1, "object": "Cube", "face": "F1"},
    "/api/as-built": {"do": "estimate", "after": 0, "material": "PLA"},
    "/api/touch": {"object": "Cube", "face": "F1", "x_mm": 30.0, "y_mm": 30.0, "force_n": 40.0},
    "/api/load": {"newtons": 3.0}, "/api/unplug": {"seconds": 0.0},
    "/api/touches/{number}": {"name": "mine"},
}  # fmt: skip
NAMES = ("Cube", "Box", "a.h5", "link.h5", "..%2fsecret.txt", "../../secret.txt", "%2e%2e%2flab.db",
         "lab.db", "c.json", "0", "1", "-1", "99999999999999999999", "1e3", "F1", "x" * 3000,
         "é", "%00", "%ff", "a.h5%00.txt", "..", ".", "", "nan", "' or 1=1 --", "app.js",
         "index.html", "recordings%5ca.h5", "//etc/passwd", "con", "C:%5cx.h5")  # fmt: skip


def write_request(rng: random.Random, _folder: Path) -> dict[str, Any]:
    """Return a request that the page would not make: method, address, headers, bodies."""
    made: dict[str, Any] = {"seed": rng.randrange(2**32), "kind": "http"}
    headers = {"host": "127.0.0.1:8080"}
    do = rng.random()
    if do < 0.12:
        name = rng.choice(("host", "origin", "content-length", "cookie", "authorization", "range",
                           "accept-encoding", "if-none-match", "if-modified-since", "content-type",
                           "sec-fetch-site", "x" * 3000, "if-range",
                           "transfer-encoding"))  # fmt: skip
        headers[name] = rng.choice(("[", "http://[", "[::1", "[::1]:8080", "127.0.0.1:8080:1", "::",
                                    "http://127.0.0.1:8080", "null", "bytes=0-,1-,2-,3-", "é",
                                    "bytes=-99999999999", "bytes=5-1", "gzip;q=nan", "-1", "1e9",
                                    "127.0.0.1:99999999", "127.0.0.1:x", "a b", "http://[::1]:x",
                                    "Bearer é", "application/json; charset=utf-99", "\t", "%",
                                    "http://127.0.0.1:8080@evil", *WORDS[:9]))  # fmt: skip
    made["headers"] = headers
    made["live"] = rng.random() < 0.1
    made["gone"] = rng.random() < 0.03  # before the body ended
    if made["live"]:
        headers.setdefault("origin", "http://127.0.0.1:8080")
    made["words"] = [
        rng.choice((
            lambda: json.dumps({"filter": rng.choice(("raw", "median", "sobel", "evil", None, 3))}),
            lambda: json.dumps(anything(rng)), lambda: "x" * 5000, lambda: "[" * 1000,
            lambda: '{"filter": ["raw"]}', lambda: '{"filter": {"a": 1}}', lambda: "1" * 999,
            lambda: b"bytes", lambda: "", lambda: "\ud800",
        ))() for _ in range(rng.choice((0, 1, 2)))
    ]  # fmt: skip
    made["upload"] = None
    if rng.random() < 0.05:
        folder = Path(tempfile.mkdtemp())
        path = write_recording(rng, folder)[0]
        made["upload"] = path.read_bytes()[: 1 << 20]
        shutil.rmtree(folder)
    return made


_PAGE: list[Page] = []


def read_request(made: dict[str, Any], out: Path) -> None:
    """Ask the page; no answer is an error of the server, none holds what is not meant to be."""
    if not _PAGE:
        folder = out.parent.parent / "bench"
        shutil.rmtree(folder, ignore_errors=True)
        _PAGE.append(Page(folder))
    page, rng = _PAGE[0], random.Random(made["seed"])
    path, methods = rng.choice(page.routes)
    template = path
    method = rng.choice((*methods, *methods, *methods, "GET", "POST", "PUT", "OPTIONS", "X"))
    for mark in ("{name}", "{number}", "{number:int}", "{face}", "{path:path}"):
        path = path.replace(mark, rng.choice(NAMES))
    if path == "/static":
        path += "/" + rng.choice(NAMES) * rng.choice((1, 1, 3))
    query = b""
    if rng.random() < 0.1:
        query = rng.choice(
            (b"name=%2e%2e%2fx.h5", b"name=x.h5&name=y.h5", b"=&&", b"%ff", b"a" * 9999)
        )
    body: bytes = rng.choice((b"", b"{", b"null", b"[" * 60_000, b"\xff\xfe", b"{}" * 3))
    if template in BODIES and rng.random() < 0.85:
        value = mutated(rng, BODIES[template])
        body = written_json(rng, value)
    if made["upload"] is not None:
        path, method, body = "/api/recordings", "POST", made["upload"]
        query = b"name=up.h5"
        (page.session.folder / "up.h5").unlink(missing_ok=True)
    headers = dict(made["headers"])
    headers.setdefault("content-type", "application/json")
    raw = [
        (k.encode("latin-1", "replace"), v.encode("utf-8", "replace")) for k, v in headers.items()
    ]
    from urllib.parse import unquote

    scope = {
        "type": "http", "method": method, "path": unquote(path, errors="replace"),
        "raw_path": path.encode(), "query_string": query, "headers": raw, "scheme": "http",
        "http_version": "1.1", "server": ("127.0.0.1", 8080), "client": ("127.0.0.1", 5),
        "root_path": "",
        "asgi": {"version": "3.0"}, "extensions": {}, "subprotocols": [],
    }  # fmt: skip
    bodies: list[Any] = [{"type": "http.request", "body": body, "more_body": made["gone"]}]
    if made["live"]:
        scope |= {"type": "websocket", "path": "/live", "scheme": "ws"}
        bodies = [{"type": "websocket.connect"}] + [
            {"type": "websocket.receive", "bytes" if isinstance(word, bytes) else "text": word}
            for word in made["words"]
        ]
    sent = page.ask(scope, bodies)
    held = b"".join(m.get("body", b"") or b"" for m in sent)
    if b"kept to itself" in held or held.startswith((b"SQLite format", b"root:")):
        raise LeakError(f"{method} {path[:60]}")
    status = [m["status"] for m in sent if m["type"] == "http.response.start"]
    if not status and (made["live"] or made["gone"]):
        return
    if len(status) != 1 or (status[0] >= 500 and status[0] != 503):
        raise AssertionError(f"{method} {template}: {status}")
    if status[0] >= 400:
        said = json.loads(held) if held and method != "HEAD" else {}
        raise EncodedObjectsError(str(said)[:80], fix="-", place=path)


KINDS: dict[str, Kind] = {
    "recording": Kind(write_recording, read_recording, sound=(recordings,)),
    "array": Kind(write_array, read_array, most_bytes=2 * MOST_BYTES, sound=(arrays,)),
    "mcap": Kind(write_mcap, read_mcap, sound=(mcap_file,)),
    "calibration": Kind(write_calibration, read_calibration),
    "state": Kind(write_state, read_state, sound=(state_text,)),
    "sensor type": Kind(write_sensor_type, read_sensor_type),
    "printer": Kind(write_printer, read_printer),
    "spec": Kind(write_spec, read_spec),
    "command": Kind(write_spec, read_by_command, (1, 2, 4), longest_s=30.0),
    "stl": Kind(_shape_writer(".stl"), read_model),
    "obj": Kind(_shape_writer(".obj"), read_model),
    "step": Kind(_shape_writer(".step"), read_model_in_fork, sound=(load_kernel,)),
    "3mf": Kind(write_3mf, read_3mf),
    "database": Kind(write_database, read_database, (4, 2), sound=(labs,)),
    "import": Kind(write_database, read_exchange, (4,), sound=(labs,)),
    "packets": Kind(write_packets, read_packets, file=False),
    "line": Kind(write_line, read_line, file=False),
    "port": Kind(write_url, read_url, (2, 3, 4), file=False, placed=False, sound=(recordings,)),
    "page": Kind(write_request, read_request, file=False, sound=(labs, recordings, state_text)),
}


# -- a case


def prepare(name: str, root: Path) -> None:
    """Make what is damaged and load what reads it, once in a process and for its children."""
    for sound in KINDS[name].sound:
        sound()
    _kept()
    if name != "page":  # which has threads
        for number in range(-9, 0):
            attempt(name, number, root)


def attempt(name: str, number: int, root: Path) -> Outcome:
    """Make the case of a number, read it in this process, and return what became of it.

    `root` is a folder for cases alone: the secret stands in it, and a folder `box` is given.
    """
    kind, rng = KINDS[name], random.Random(f"{name} {number}")
    box, spare = root / "box", root / ("bench-tmp" if name == "page" else "tmp")
    given_folder, out = box / "in", box / "out"
    for folder in (given_folder, out, spare):
        folder.mkdir(parents=True, exist_ok=True)
        if name != "page" or folder != spare:
            _clear(folder)
    secret = root / "secret.txt"
    secret.write_bytes(SECRET)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the libraries that write
        given = kind.write(rng, given_folder)
    path = given[0] if isinstance(given, tuple) else given
    if kind.file and rng.random() < 0.02:
        no_file(rng, path)
    before = _names(root)
    tempfile.tempdir = str(spare)
    here = Path.cwd()
    os.chdir(box)
    start, megabytes = time.monotonic(), 0.0
    try:
        with _watched(kind.longest_s) as took, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            kind.read(given, out)
        what, detail = READ, ""
    except EncodedObjectsError as error:
        what, detail = _refusal(error, kind, path)
    except HangError as error:
        what, detail = "hang", _where(error)
    except MemoryError as error:
        what, detail = "memory", _where(error)
    except LeakError as error:
        what, detail = "leak", str(error)
    except LeftError as error:
        what, detail = "left outside", f"of what was refused: {error}"
    except WrongValueError as error:
        what, detail = "wrong value", str(error)
    except Exception as error:  # noqa: BLE001  (which is what is looked for)
        what, detail = "traceback", _where(error)
    finally:
        os.chdir(here)
        tempfile.tempdir = None
    seconds, megabytes = time.monotonic() - start, took[0]
    if what in (READ, REFUSED):
        new = sorted(_names(root) - before)
        if new:
            what, detail = "left outside", ", ".join(new)[:80]
        elif secret.read_bytes() != SECRET:
            what, detail = "left outside", "the secret was changed"
        elif megabytes * 2**20 > kind.most_bytes:
            what, detail = "memory", f"{megabytes:.0f} MB"
        elif seconds > kind.longest_s:
            what, detail = "hang", f"{seconds:.0f} s"
    return Outcome(what, detail, seconds, megabytes)


def _refusal(error: EncodedObjectsError, kind: Kind, path: Any) -> tuple[str, str]:
    """Return what a refusal is worth: its place, way out and exit code."""
    said = f"{type(error).__name__}: {error.cause[:60]}"
    if error.exit_code not in kind.codes:
        return "wrong code", f"{error.exit_code} {said}"
    text = "".join(error.as_text().splitlines()) if error.place == "c.yaml" else error.as_text()
    text += " lab.db" if "home.db" in text else ""  # the two of an import
    named = not isinstance(path, Path) or not kind.placed or path.name in text
    if kind.file and path.name in ("c.yaml", "printer.yaml"):  # which name other files
        named = bool(error.place)
    if not named or not error.fix:
        return "no place", said
    if any(c != "\n" and not c.isprintable() for c in text):
        return "no place", f"not printable: {said!r}"
    return REFUSED, said


def _where(error: BaseException) -> str:
    """Return the error and the last places of our packages that it went through."""
    ours = [f"{Path(frame.filename).name}:{frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if "/tests/" not in frame.filename and "/site-packages/" not in frame.filename
            and "/lib/python" not in frame.filename]  # fmt: skip
    return f"{type(error).__name__}: {str(error)[:60]!r} at {' < '.join(ours[:-4:-1])}"


def _clear(folder: Path) -> None:
    """Empty a folder."""
    for entry in os.scandir(folder):
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path)
        else:
            os.unlink(entry.path)


def scratch() -> str | None:
    """Return where cases are quick: in memory, where there is such a folder."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def _names(root: Path) -> set[str]:
    """Return all names below the root but what a reader may make: its output, its session."""
    found = set()
    for folder, folders, files in os.walk(root):
        shown = os.path.relpath(folder, root)
        if shown in ("box/out", "bench", "bench-tmp"):
            folders.clear()
            continue
        found |= {os.path.join(shown, one) for one in (*folders, *files)}
    # what SQLite and the schema's update keep next to a database is theirs
    return {one for one in found if not one.startswith("box/in/lab.") and one != "./bench"}


@contextmanager
def _watched(longest_s: float) -> Iterator[list[float]]:
    """Bound time and memory; yields a list of the megabytes that were taken at most."""
    took = [0.0]

    def late(*_: object) -> None:
        raise HangError(f"longer than {longest_s:g} s")

    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    size, base = _status("VmSize"), _status("VmRSS")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (size + ROOM, limits[1]))
    handler = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, longest_s)
    try:
        yield took
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, limits)
        took[0] = max(0.0, (_status("VmHWM") - base) / 2**20)


def _status(name: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(f"{name}:"):
            return int(line.split()[1]) << 10
    return 0
