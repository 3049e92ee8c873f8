"""Recordings, arrays of others, and MCAP."""

import io
import shutil
import struct
import zipfile
from contextlib import suppress
from functools import cache

import h5py
import numpy as np
from hostile_recordings import HOSTILE, write_hostile
from recorded import record, same

from foreign.case import BOMBS_MB, GOOD, MOST_BYTES, FaultError, Kind, kept
from foreign.damage import WORDS, bomb, damaged, damaged_text


@cache
def recorded_files():
    """Return recordings: of ours, of others, one that was not closed."""
    folder, given = kept()
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


def _odd_attribute(rng):
    return rng.choice((
        lambda: rng.choice([w for w in WORDS if "\0" not in w and "\ud800" not in w]),
        lambda: rng.choice([0, -1, 2**63 - 1, 10**9, 0.5, np.nan, np.inf, True]),
        lambda: np.bytes_(b"\xff\xfe\x80"), lambda: np.zeros(rng.choice((0, 1, 70))),
        lambda: np.array(["a", "b"], h5py.string_dtype()), lambda: h5py.Empty("f8"),
        lambda: np.zeros((), [("a", "i4"), ("b", "f8")]), lambda: np.complex128(1),
        lambda: np.array([1, 2], np.uint8), lambda: h5py.Reference(), lambda: "x" * 60_000,
    ))()  # fmt: skip


def _odd_dataset(rng, file, name):
    n = rng.choice((0, 1, GOOD - 1, GOOD, GOOD + 1, 2 * GOOD))
    shape = rng.choice(((), (n,), (n, 4), (n, 16, 16), (n, 4, 4), (n, 16, 16, 1), (n, 0, 16),
                        (n, 1, 1), (n, 255, 255), (2, n, 16), (n, 16, 17)))  # fmt: skip
    pair = np.dtype([("a", "u2"), ("b", "u2")])
    kind = rng.choice(("u1", "u2", ">u2", "i2", "i8", "u8", "f2", "f4", "f8", "c8", "?", "S5", "V3",
                       h5py.string_dtype(), h5py.ref_dtype, h5py.vlen_dtype("i4"), pair,
                       h5py.enum_dtype({"a": 1}), np.dtype(("u2", (2,)))))  # fmt: skip
    how = rng.choice(({}, {"chunks": True}, {"chunks": True, "compression": 9},
                      {"chunks": True, "fletcher32": True, "shuffle": True},
                      {"chunks": True, "scaleoffset": 3}, {"chunks": True, "compression": "lzf"},
                      {"maxshape": (None,) * len(shape)}))  # fmt: skip
    if isinstance(kind, str) and np.dtype(kind).kind in "iuf":
        fill = rng.choice((0, 100, -1, 0.5, 1e30, np.nan, np.inf))
        how = how | {"fillvalue": np.array(fill).astype(kind)}
    file.create_dataset(name, shape, kind, **how)


def _edit_hdf5(rng, path):
    """Change what is in a file; what leads out of it is in `hostile_recordings`."""
    with h5py.File(path, "r+") as file:
        for _ in range(rng.choice((1, 1, 2, 3))):
            name, do = rng.choice((*DATASETS, "extra")), rng.randrange(8)
            with suppress(TypeError, ValueError, OSError, RuntimeError, LookupError):
                if do < 2:
                    file.attrs[rng.choice(ATTRIBUTES)] = _odd_attribute(rng)
                elif do == 2:
                    del file.attrs[rng.choice(list(file.attrs))]
                else:
                    file.pop(name, None)
                    if do < 6:
                        _odd_dataset(rng, file, name)
                    elif do == 6:
                        file[name] = h5py.SoftLink("/" + rng.choice(DATASETS))


def write_recording(rng, folder):
    how = rng.choice(("read", "read", "live", "repair", "import"))
    do = rng.random()
    if do < 0.15:
        path = folder / "a.h5"
        write_hostile(rng.choice([k for k in HOSTILE if k != "10,002 objects"]), path)
        return path, how, False
    of = rng.choice(("ours", "ours", "others", "journal"))
    path = folder / ("a.part.h5" if of == "journal" else "a.h5")
    content = recorded_files()[of]
    if of == "journal" or do < 0.55:
        path.write_bytes(damaged(rng, content))
        return path, rng.choice(("live", "repair")) if of == "journal" else how, of != "others"
    path.write_bytes(content)
    _edit_hdf5(rng, path)
    return path, how, False


def read_recording(given, out):
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
    known = {frame.seq: frame for frame in kept()[1]}
    for frame in read.frames():
        image = frame.counts.astype("<u2").tobytes()
        if b"kept to" in image or b"kept to" in frame.counts.astype("u1").tobytes():
            raise FaultError("leak", "bytes of the secret in an image")
        true = known.get(frame.seq)
        if whole and how != "import" and (true is None or not same(frame, true)):
            raise FaultError("wrong value", f"frame {frame.seq} of {path.name} ({how})")


# -- arrays of others


@cache
def arrays():
    from scipy.io import savemat

    images = np.stack([one.counts for one in kept()[1]]).astype(np.uint16)
    made = {}
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


def _npy_of(head, body=b"", major=1):
    length = struct.pack("<H" if major == 1 else "<I", min(len(head), 65535))
    return b"\x93NUMPY" + bytes((major, 0)) + length + head.encode() + body


def _npy(rng):
    shape = rng.choice(("(48, 16, 16)", "(1000000000, 16, 16)", "(-1, 16, 16)", "(16, 16)", "()",
                        "(48,)", "(True, 16, 16)", "(4.5, 16, 16)", "None", "(0, 16, 16)",
                        "(99999999999999999999, 16, 16)", "(16, 16, 48)"))  # fmt: skip
    kind = rng.choice(("'<u2'", "'>u2'", "'|O'", "'<f8'", "'<c16'", "'|S9'", "[('a', '<u2')]",
                       "'<M8[s]'", "'|b1'", "'<U3'", "'|V2'", "('<u2', (10**9,))",
                       "3"))  # fmt: skip
    order = rng.choice(("False", "True", "None", "2"))
    head = f"{{'descr': {kind}, 'fortran_order': {order}, 'shape': {shape}, }}"
    if rng.random() < 0.1:
        head = rng.choice(("", "{", "()" * 9000, "[" * 300, "{'a': 1}", "__import__('os')"))
    body = np.full(48 * 256, rng.choice((0, 7, 65535)), "<u2").tobytes()[: rng.choice((1, 24576))]
    return _npy_of(head + "\n", body, rng.choice((1, 2, 3, 9)))


def write_array(rng, folder):
    kind = rng.choice(("npy", "npz", "mat", "csv"))
    path = folder / f"a.{kind}"
    do = rng.random()
    content = damaged(rng, arrays()[kind])
    if kind == "csv" and do < 0.7:
        content = damaged_text(rng, arrays()[kind].decode(), (",", ";", '"', "\r", "\n", "nan,"))
    elif kind == "npy" and do < 0.6:
        content = _npy(rng)
    elif kind == "npz" and do < 0.05:
        head = "{'descr': '<u2', 'fortran_order': False, 'shape': (1000000, 16, 16), }\n"
        content = bomb(rng.choice(BOMBS_MB), "frames.npy", _npy_of(head))
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


def read_array(path, out):
    from probe.recording.imported import import_array

    for frame in import_array(path, out / "b.h5").frames():
        frame.counts.max()


# -- MCAP


@cache
def mcap_file():
    """Return a recording of ours as MCAP."""
    from probe.recording.mcap import export_mcap
    from probe.recording.read import Recording

    recorded_files()
    out = kept()[0] / "a.mcap"
    export_mcap(Recording(kept()[0] / "a.h5"), out)
    return out.read_bytes()


IMAGE_OF_ZEROS = {
    "header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "sensor"}, "height": 16, "width": 16,
    "encoding": "32FC1", "is_bigendian": 0, "step": 64, "data": bytes(1024),
}  # fmt: skip


def _odd_mcap(rng):
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


def write_mcap(rng, folder):
    path = folder / "a.mcap"
    only_bytes = rng.random() < 0.6
    path.write_bytes(damaged(rng, mcap_file()) if only_bytes else _odd_mcap(rng))
    return path, only_bytes


def read_mcap(given, out):
    """Import MCAP; its chunks have check sums."""
    from probe.recording.mcap import import_mcap

    path, only_bytes = given
    known = {frame.seq: frame for frame in kept()[1]}
    for frame in import_mcap(path, out / "b.h5").frames():
        true = known.get(frame.seq)
        if only_bytes and (true is None or not same(frame, true)):
            raise FaultError("wrong value", "a frame that was not recorded")


KINDS = {
    "recording": Kind(write_recording, read_recording, sound=(recorded_files,)),
    "array": Kind(write_array, read_array, most_bytes=2 * MOST_BYTES, sound=(arrays,)),
    "mcap": Kind(write_mcap, read_mcap, sound=(mcap_file,)),
}
