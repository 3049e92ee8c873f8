"""Recordings that lead to other files or claim more than they hold, and those that may be large."""

import h5py
import numpy as np
import pytest
from hostile_recordings import HOSTILE, IMAGES, SECRET, write_hostile
from recorded import frames, record

from probe.command import run
from probe.errors import RecordingError
from probe.recording.guard import strings_end
from probe.recording.imported import import_array
from probe.recording.read import Recording
from probe.recording.repair import repair

MANY = 40_000  #: frames, 20 MB of values


@pytest.fixture
def folder(tmp_path):
    """A folder, with a secret in the one above."""
    (tmp_path / SECRET).write_bytes(b"kept to itself " * 80)
    folder = tmp_path / "recordings"
    folder.mkdir()
    return folder


@pytest.mark.parametrize("kind", HOSTILE)
def test_it_is_refused_before_a_value_is_read(folder, kind, monkeypatch):
    path = write_hostile(kind, folder / "a.h5")

    def value(*_):
        raise AssertionError("a value was asked for")

    monkeypatch.setattr(h5py.Dataset, "__getitem__", value)
    for attempt in (
        lambda: list(Recording(path).frames()),
        lambda: Recording(path, live=True),
        lambda: repair(path),
        lambda: import_array(path, folder / "b.h5", dataset="frames"),
    ):
        with pytest.raises(RecordingError) as caught:
            attempt()
        assert HOSTILE[kind][1] in caught.value.cause
        assert caught.value.fix
        assert caught.value.place == str(path)
    assert [file.name for file in folder.iterdir()] == ["a.h5"]


@pytest.mark.parametrize(
    "words",
    [
        ("info", "a.h5"), ("replay", "a.h5"), ("repair", "a.h5"),
        ("info", "file:a.h5"), ("record", "file:a.h5", "-o", "out.h5"),
        ("calibrate", "bias", "a.h5"),
        ("calibrate", "loads", "a.h5=0", "a.h5=9", "-o", "c.json"),
        ("import", "a.h5", "-o", "out.h5"),
        *(("export", "a.h5", f"--{kind}", f"out.{kind}") for kind in ("csv", "npy", "png", "mcap")),
    ],
    ids=" ".join,
)  # fmt: skip
def test_commands_refuse_it(folder, words, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    write_hostile("external storage", folder / "a.h5")
    assert run(list(words)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "leads to another file" in err
    assert "a.h5" in err
    assert "fix: " in err
    assert [file.name for file in folder.iterdir()] == ["a.h5"]


def test_links_within_a_file_are_followed(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["held/images"] = IMAGES + 3
        file["frames"] = h5py.SoftLink("/held/images")
        file["held/above"] = file["/"]  # a group within itself
        file["again"] = file["held"]
    assert (Recording(tmp_path / "a.h5").block().counts == 3).all()


def test_a_few_images_that_were_never_written_are_zeros(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("frames", (16_000, 16, 16), np.uint16, chunks=(64, 16, 16))
    assert sum(len(block) for block in Recording(tmp_path / "a.h5").blocks()) == 16_000


@pytest.mark.parametrize("side", [1024, 1025])
def test_images_are_of_bounded_size(tmp_path, side):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["frames"] = np.zeros((20, side, side), np.uint8)
    if side == 1024:
        sizes = [len(block) for block in Recording(tmp_path / "a.h5").blocks()]
        assert sizes == [16, 4]  # not all of them at once
        return
    with pytest.raises(RecordingError, match="images are of 1025 x 1025, at most 1,048,576"):
        Recording(tmp_path / "a.h5")


@pytest.mark.parametrize("chunk", [64, MANY, None])
def test_minutes_of_others_are_a_recording_however_they_are_stored(tmp_path, chunk):
    packed = {} if chunk is None else {"chunks": (chunk, 16, 16), "compression": 9}
    with h5py.File(tmp_path / "a.h5", "w") as file:
        images = np.zeros((MANY, 16, 16), np.uint16)
        images[:, 3, 4] = np.arange(MANY) % 1024
        file.create_dataset("frames", data=images, **packed)
    first = [block.counts[0, 3, 4] for block in Recording(tmp_path / "a.h5").blocks()]
    assert first == [number % 1024 for number in range(0, MANY, 256)]


@pytest.mark.parametrize("number", [1, 8000])
def test_strings_without_end_are_damage(folder, number):
    path = folder / "a.h5"
    with h5py.File(path, "w") as file:
        file["frames"] = np.zeros((number, 16, 16), np.uint16)
        file.attrs["sensor"] = "mat 3"
    written = bytearray(path.read_bytes())
    assert strings_end(path)
    at = written.index(b"GCOL")
    assert (at > 4_000_000) == (number == 8000)  # behind the images
    written[at + 16 : at + 528] = bytes(512)  # a sector that was lost
    path.write_bytes(written)
    for attempt, said in ((Recording, "cannot read it"), (repair, "nothing in it can be read")):
        with pytest.raises(RecordingError, match=f"it is damaged: {said}"):
            attempt(path)


def test_collections_in_one_another_are_damage(folder):
    head = b"GCOL\x01\0\0\0" + (1 << 20).to_bytes(8, "little")
    (folder / "a.h5").write_bytes(head * (1 << 16))
    assert not strings_end(folder / "a.h5")  # which would be looked at 65,536 times


@pytest.mark.parametrize("length", range(0, 20, 4))
def test_free_space_counts_its_own_head(folder, length):
    written = bytearray(record(folder / "a.h5", frames(1)).files[0].read_bytes())
    at = written.index(b"GCOL")
    written[at + 16 : at + 18] = bytes(2)
    written[at + 24 : at + 32] = length.to_bytes(8, "little")
    (folder / "a.h5").write_bytes(written)
    assert strings_end(folder / "a.h5") == (length == 16)
