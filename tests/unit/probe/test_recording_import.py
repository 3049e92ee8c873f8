"""Others' arrays and ROS messages become recordings, and ours messages: formats, axes, refusals."""

import json
import os
import zlib

import h5py
import numpy as np
import pytest
from mcap_ros2.writer import Writer
from recorded import frames as made_frames
from recorded import pose_at, record
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat
from zstandard import ZstdCompressor

from probe.errors import RecordingError
from probe.recording.imported import import_array
from probe.recording.mcap import export_mcap, import_mcap
from probe.recording.read import Recording
from probe.recording.ros import DEFINITIONS, IMAGE, POSE, TOUCH_FRAME, covariance_message
from probe.recording.table import export_csv
from recognizer.validation.dataset_formats import write_ftp1

COUNTS = np.random.default_rng(5).integers(0, 1024, (70, 16, 16)).astype(np.uint16)


def matlab_73(path, **variables):
    """Write what MATLAB's `save -v7.3` writes: axes in reverse order, a class on each."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in variables.items():
            file[name] = np.asarray(values).T
            file[name].attrs["MATLAB_class"] = np.bytes_(b"uint16")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))
    return path


def refused(path, match, **options):
    out = path.parent / "out.h5"
    with pytest.raises(RecordingError, match=match) as caught:
        import_array(path, out, **options)
    assert caught.value.fix
    assert not list(path.parent.glob("out*"))


@pytest.mark.parametrize("axes", ["time first", "time last"])
@pytest.mark.parametrize("kind", ["mat7.3", "h5"])
def test_every_format_gives_the_same_frames(tmp_path, kind, axes):
    array = COUNTS if axes == "time first" else np.moveaxis(COUNTS, 0, 2)
    path = tmp_path / f"others.{kind[:3]}"
    if kind == "mat7.3":
        matlab_73(path, images=array, rate=np.array([[220.0]]))
    else:
        with h5py.File(path, "w") as file:
            file["trial/images"] = array
            file["trial/force"] = np.zeros(70)
    recording = import_array(path, tmp_path / "out.h5", rate_hz=100, sensor="theirs")
    block = recording.block()
    assert (block.counts == COUNTS).all()
    assert block.seq.tolist() == list(range(70))
    assert block.t_ns[7] == 70_000_000
    assert recording.origin.sensor == "theirs"
    assert recording.origin.units == "counts"
    assert recording.origin.more["imported_from"] == path.name
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([path.name, "out.h5"])


def test_values_that_are_no_numbers_are_refused(tmp_path):
    values = COUNTS.astype(np.float32)
    values[37, 1, 1] = np.inf
    np.save(tmp_path / "a.npy", values)
    refused(tmp_path / "a.npy", "no numbers, the first in image 37; ")
    np.save(tmp_path / "b.npy", COUNTS * 5e-324)
    refused(tmp_path / "b.npy", "nothing above")
    np.save(tmp_path / "c.npy", np.where(COUNTS > 500, 1e308, -1e308))
    assert import_array(tmp_path / "c.npy", tmp_path / "c.h5").block().counts.max() == 65535


def test_files_without_images_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((70, 32, 32)))
    refused(tmp_path / "a.npy", r"no array of images \(N, 16, 16\) in it, but a \(70, 32, 32\)")
    refused(tmp_path / "a.npy", "give the --sensor-type mat-32x32, or reshape it")
    np.savez(tmp_path / "two.npz", left=COUNTS, time=np.arange(70))
    refused(tmp_path / "two.npz", "no array of images 'up' in it, but left", dataset="up")
    np.save(tmp_path / "b.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    refused(tmp_path / "b.npy", "it holds objects")
    np.save(tmp_path / "c.npy", COUNTS + 1j)
    refused(tmp_path / "c.npy", "no array of images")
    savemat(tmp_path / "h.mat", {"images": COUNTS})
    for name, content in (
        ("d.npy", (tmp_path / "a.npy").read_bytes()[:500]),
        ("h.mat", (tmp_path / "h.mat").read_bytes()[:9000]),
        ("e.mat", b"x" * 300),
        ("f.mat", b""),
        ("g.bin", b"x" * 300),
    ):
        (tmp_path / name).write_bytes(content)
        refused(tmp_path / name, "damaged|no HDF5 file|empty")


def test_rosbags_reads_it(tmp_path):
    """By the message types that rosbags knows itself, ours by the definition in the file."""
    path, store = tmp_path / "a.mcap", get_typestore(Stores.ROS2_HUMBLE)
    frames = [frame for i in range(9) for frame in made_frames(1, first=i, pose=pose_at(i / 3))]
    record(tmp_path / "touch.h5", frames)
    export_mcap(Recording(tmp_path / "touch.h5"), path)
    with AnyReader([path], default_typestore=store) as reader:
        topics = {c.topic: c.msgtype for c in reader.connections}
        assert topics == {"/touch/image": IMAGE, "/touch/frame": TOUCH_FRAME, "/touch/pose": POSE}
        read = [(c.topic, reader.deserialize(raw, c.msgtype)) for c, _, raw in reader.messages()]
    images = [message for topic, message in read if topic == "/touch/image"]
    assert {(m.encoding, m.height, m.width, m.step) for m in images} == {("32FC1", 16, 16, 64)}
    shown = sorted(message.data.tobytes() for message in images)
    assert shown == sorted(frame.counts.astype("<f4").tobytes() for frame in frames)
    rests = {message.seq for topic, message in read if topic == "/touch/frame"}
    assert rests == {frame.seq for frame in frames}
    at = sorted(message.pose.position.x for topic, message in read if topic == "/touch/pose")
    known = sorted(frame.pose[0, 3] / 1000 for frame in frames)
    assert at == pytest.approx(known, abs=1e-15)


def robots_file(path, *, encoding="16UC1", dtype="<u2", image=None, step=None):
    """Write what a robot's own recorder writes: images and poses on topics of its own."""
    image = np.arange(256).reshape(16, 16) if image is None else image
    with open(path, "wb") as stream:
        writer = Writer(stream)
        kinds = {kind: writer.register_msgdef(kind, DEFINITIONS[kind]) for kind in (IMAGE, POSE)}
        for i in (1, 0):
            stamp = {"sec": 1_700_000_000, "nanosec": i * 5_000_000}
            head = {"stamp": stamp, "frame_id": "finger"}
            fields = {"header": head, "height": 16, "width": 16, "encoding": encoding}
            fields |= {"is_bigendian": int(dtype[0] == ">"), "step": step or 16 * int(dtype[2])}
            fields["data"] = (image + i).astype(dtype).tobytes()
            when = stamp["sec"] * 10**9 + stamp["nanosec"]
            writer.write_message("/finger/tactile", kinds[IMAGE], fields, log_time=when + 77)
            at = {"x": 0.1 * i, "y": 0.2, "z": 0.3}
            turn = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
            pose = {"header": head, "pose": {"position": at, "orientation": turn}}
            writer.write_message("/finger/pose", kinds[POSE], pose, log_time=when + 99)
        writer.finish()
    return path


@pytest.mark.parametrize(("encoding", "dtype"), [("16UC1", "<u2"), ("32FC1", ">f4")])
def test_images_of_others_become_a_recording(tmp_path, encoding, dtype):
    path = robots_file(tmp_path / "robot.mcap", encoding=encoding, dtype=dtype)
    block = import_mcap(path, tmp_path / "r.h5").block()
    assert np.array_equal(block.counts[1], np.arange(256).reshape(16, 16) + 1)
    assert np.diff(block.t_ns).tolist() == [5_000_000]
    assert np.allclose(block.pose[:, 0, 3], [0, 100])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"encoding": "rgb8", "dtype": "<u2"}, "image 0 is encoded as rgb8"),
        ({"encoding": "32FC1", "dtype": "<f4", "image": np.full((16, 16), np.nan)}, "no numbers"),
        ({"step": 31}, "bytes, not 16 rows of 31"),
    ],
)
def test_images_that_are_none_are_refused_and_nothing_is_left(tmp_path, options, said):
    path = robots_file(tmp_path / "robot.mcap", **options)
    with pytest.raises(RecordingError, match=said) as caught:
        import_mcap(path, tmp_path / "r.h5")
    assert caught.value.fix
    assert [p.name for p in tmp_path.iterdir()] == ["robot.mcap"]


def test_values_of_others_that_are_no_counts_are_scaled_as_those_of_an_array(tmp_path):
    image = np.linspace(-0.9, 0.01, 256).reshape(16, 16)
    path = robots_file(tmp_path / "robot.mcap", encoding="32FC1", dtype="<f4", image=image)
    made = import_mcap(path, tmp_path / "r.h5")
    np.save(tmp_path / "a.npy", (image + np.arange(2)[:, None, None]).astype("<f4"))
    same = import_array(tmp_path / "a.npy", tmp_path / "a.h5")
    np.testing.assert_array_equal(made.block().counts, same.block().counts)
    for name in ("scale", "scale_offset"):
        assert made.origin.more[name] == same.origin.more[name]
    assert made.origin.units == "scaled"


def test_a_table_of_ours_comes_back_with_times_numbers_wrist_and_poses(tmp_path):
    given = [f for i in range(5) for f in made_frames(1, first=7 * i, pose=pose_at(i / 3))]
    given += made_frames(3, first=50)
    record(tmp_path / "a.h5", given)
    export_csv(tmp_path / "a.h5", tmp_path / "a.csv")
    before = Recording(tmp_path / "a.h5").block().datasets()
    after = import_array(tmp_path / "a.csv", tmp_path / "b.h5").block().datasets()
    assert set(before) == set(after)
    for name, values in before.items():
        np.testing.assert_array_equal(values, after[name])


def test_numbers_of_columns_are_no_image(tmp_path):
    table = COUNTS[:5].reshape(5, -1)
    for head, given in ((range(256), table), ([], table)):
        lines = [",".join(map(str, line)) for line in (head, *given)]
        (tmp_path / "a.csv").write_text("\n".join(lines))
        made = import_array(tmp_path / "a.csv", tmp_path / "a.h5", replace=True)
        np.testing.assert_array_equal(made.block().counts, COUNTS[:5])


def test_times_that_are_not_read_are_named(tmp_path):
    np.savez(tmp_path / "a.npz", frames=COUNTS, time=np.arange(70) / 50, rate=np.array([50]))
    names = ["time_s\0", *(f"r{r}c{c}" for r in range(16) for c in range(16))]
    lines = [",".join(map(str, [n / 50, *image.flat])) for n, image in enumerate(COUNTS)]
    (tmp_path / "a.csv").write_text("\n".join([",".join(names), *lines]))
    for name, said in (("a.npz", "time"), ("a.csv", "time_s")):
        made = import_array(tmp_path / name, tmp_path / "a.h5", replace=True)
        assert made.origin.more["not_read"] == said


HEADS = {
    "ours": lambda r, c: f"r{r}c{c}",
    "from 1": lambda r, c: f"r{r + 1}c{c + 1}",
    "in capitals": lambda r, c: f"R{r}C{c}",
}


@pytest.mark.parametrize("head", HEADS)
def test_tactels_of_a_table_are_taken_by_name(tmp_path, head):
    names = [HEADS[head](r, c) for c in range(16) for r in range(16)]  # by columns
    lines = [",".join(["t_ns", *names])]
    lines += [",".join(map(str, [20 * n, *image.T.flat])) for n, image in enumerate(COUNTS[:3])]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    block = import_array(tmp_path / "a.csv", tmp_path / "a.h5").block()
    np.testing.assert_array_equal(block.counts, COUNTS[:3])
    assert block.t_ns.tolist() == [0, 20, 40]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("r3c4", "r0c0", "csv:1: its head names 255 tactels in 256 columns, not r0c0 ... r15c15"),
        ("r3c4", "x", "its head names 255 tactels in 255 columns"),
        ("r0c0", "r1c1", "its head names 255 tactels in 256 columns"),
        ("r3c4", "r16c3", "its head names 256 tactels in 256 columns"),
        ("\n5", "\n5.5", r"a\.csv:2: 5\.5 in t_ns: a time is a whole number of ns"),
        ("\n5", "\n9223372036854775808", "a time is a whole number of ns"),
    ],
)
def test_tables_whose_names_or_times_are_none_are_refused(tmp_path, old, new, said):
    names = ["t_ns", *(f"r{r}c{c}" for r in range(16) for c in range(16))]
    text = ",".join([*names, "end"]) + "\n5," + ",".join(map(str, COUNTS[0].flat)) + ",0"
    (tmp_path / "a.csv").write_text(text.replace(f"{old},", f"{new},", 1))
    refused(tmp_path / "a.csv", said)


def test_a_covariance_is_in_metres():
    covariance = np.diag([4.0, 9.0, 16.0, 0.01, 0.02, 0.03])
    covariance[0, 5] = covariance[5, 0] = 0.5
    T = np.eye(4)
    T[:3, 3] = [10, 20, 30]
    fields = covariance_message(T, covariance, 1_500_000_000, "base")
    read = np.array(fields["pose"]["covariance"]).reshape(6, 6)
    assert np.allclose(np.diag(read), [4e-6, 9e-6, 16e-6, 0.01, 0.02, 0.03])
    assert read[0, 5] == pytest.approx(0.5e-3)
    assert fields["pose"]["pose"]["position"] == {"x": 0.01, "y": 0.02, "z": 0.03}
    assert fields["header"]["stamp"] == {"sec": 1, "nanosec": 500_000_000}


def ftp1(path, **changed):
    """Write a store of FTP-1 with 70 touches, `changed` in the `.zarray` of its data."""
    some = {"label": np.zeros(70, int)} | dict.fromkeys(("x_mm", "y_mm", "theta_rad"), np.zeros(70))
    write_ftp1({"counts": COUNTS} | some, "fsr-16", path, {})
    described = path / "data/right_tactile_data_finger/.zarray"
    described.write_text(json.dumps(json.loads(described.read_text()) | changed))
    return path


@pytest.mark.parametrize("packed", ["zlib", "zstd", "none", "gaps"])
def test_a_store_of_ftp1_gives_the_same_frames(tmp_path, packed):
    kind = {"none": None, "zstd": {"id": "zstd"}}.get(packed, {"id": "zlib"})
    store = ftp1(tmp_path / "touches.zarr", compressor=kind)
    chunk = store / "data/right_tactile_data_finger/0.0.0.0"
    content = zlib.decompress(chunk.read_bytes())
    expected = COUNTS
    if packed == "gaps":  # what was never written is 0
        chunk.unlink()
        expected = np.zeros_like(COUNTS)
    elif packed != "zlib":
        chunk.write_bytes(content if packed == "none" else ZstdCompressor().compress(content))
    made = import_array(store, tmp_path / "touch.h5")
    assert np.array_equal([frame.counts for frame in made.frames()], expected)
    assert made.origin.more["imported_array"] == "right_tactile_data_finger/0"


def test_several_pads_in_chunks_of_their_own_are_asked_for_by_name(tmp_path):
    store = ftp1(tmp_path / "two.zarr", shape=(70, 2, 16, 16), chunks=(40, 1, 16, 16))
    folder = store / "data/right_tactile_data_finger"
    for row in range(2):
        for pad in range(2):
            part = np.zeros((40, 16, 16), np.uint16)
            own = COUNTS[40 * row : 40 * row + 40] // (pad + 1)
            part[: len(own)] = own
            (folder / f"{row}.{pad}.0.0").write_bytes(zlib.compress(part.tobytes()))
    refused(store, "several arrays of images")
    made = import_array(store, tmp_path / "b.h5", dataset="right_tactile_data_finger/1")
    assert np.array_equal([frame.counts for frame in made.frames()], COUNTS // 2)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"shape": (10**9, 1, 16, 16), "chunks": (10**5, 1, 16, 16)}, "more than its files can"),
        ({"chunks": (10**7, 1, 16, 16)}, "more than is read"),
        ({"chunks": (1, 1, 16)}, "in chunks"),
        ({"compressor": {"id": "lzma"}}, "packed by lzma"),
        ({"compressor": None}, "a chunk is damaged"),
        ({"filters": [{"id": "delta"}]}, "filters"),
        ({"dimension_separator": "/../"}, "between the numbers"),
        ({"dtype": "no type"}, "no array that is read"),
    ],
)
def test_a_store_that_cannot_be_read_is_refused(tmp_path, changed, said):
    refused(ftp1(tmp_path / "bad.zarr", **changed), said)


def test_a_chunk_is_a_file_of_its_own_size_and_a_store_of_format_2(tmp_path):
    store = ftp1(tmp_path / "bad.zarr")
    chunk = store / "data/right_tactile_data_finger/0.0.0.0"
    chunk.write_bytes(zlib.compress(bytes(10**6)))
    refused(store, "a chunk is damaged")
    chunk.unlink()
    os.mkfifo(chunk)
    refused(store, "named pipe")
    (store / "zarr.json").write_text("{}")
    refused(store, "format 3")
