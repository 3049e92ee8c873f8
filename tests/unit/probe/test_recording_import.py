"""Others' arrays become recordings: formats, axes, choice, scaling, refusals."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from probe.errors import RecordingError
from probe.recording.imported import import_array

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
@pytest.mark.parametrize("kind", ["npy", "mat", "mat7.3", "h5"])
def test_every_format_gives_the_same_frames(tmp_path, kind, axes):
    array = COUNTS if axes == "time first" else np.moveaxis(COUNTS, 0, 2)
    path = tmp_path / f"others.{kind[:3]}"
    if kind == "npy":
        np.save(path, array)
    elif kind == "mat":
        savemat(path, {"images": array, "note": "washer"})
    elif kind == "mat7.3":
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


def test_sixteen_images_have_time_first(tmp_path):
    np.save(tmp_path / "a.npy", COUNTS[:16])
    assert (
        import_array(tmp_path / "a.npy", tmp_path / "out.h5").block().counts == COUNTS[:16]
    ).all()


def test_values_that_are_no_numbers_are_refused(tmp_path):
    for bad in (np.nan, np.inf):
        values = COUNTS.astype(np.float32)
        values[37, 1, 1] = bad
        np.save(tmp_path / "a.npy", values)
        refused(tmp_path / "a.npy", "no numbers, the first in image 37; ")
    np.save(tmp_path / "b.npy", COUNTS * 5e-324)
    refused(tmp_path / "b.npy", "nothing above")
    np.save(tmp_path / "c.npy", np.where(COUNTS > 500, 1e308, -1e308))
    assert import_array(tmp_path / "c.npy", tmp_path / "c.h5").block().counts.max() == 65535


FORCES = np.random.default_rng(1).gamma(0.3, 2.0, (200, 16, 16))


@pytest.mark.parametrize(
    "values", [FORCES, FORCES - 0.25, COUNTS.astype(np.int32) - 5, COUNTS.astype(np.int64) * 1000]
)
def test_values_that_are_no_counts_are_scaled_and_say_so(tmp_path, values):
    np.save(tmp_path / "a.npy", values)
    recording = import_array(tmp_path / "a.npy", tmp_path / "out.h5")
    said, counts = recording.origin.more, recording.block().counts
    assert recording.origin.units == "scaled"
    back = said["scale_offset"] + said["scale"] * counts
    assert np.abs(back - values).max() <= 0.5001 * said["scale"]
    assert counts.max() == 65535
    assert said["scale_offset"] == min(0.0, values.min())


def test_files_without_images_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((70, 32, 32)))
    refused(tmp_path / "a.npy", r"no array of images \(N, 16, 16\) in it, but a \(70, 32, 32\)")
    refused(tmp_path / "a.npy", "give the --sensor-type mat-32x32, or reshape it")
    np.save(tmp_path / "b.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    refused(tmp_path / "b.npy", "it holds objects")
    np.save(tmp_path / "c.npy", COUNTS + 1j)
    refused(tmp_path / "c.npy", "no array of images")
    (tmp_path / "d.npy").write_bytes((tmp_path / "a.npy").read_bytes()[:500])
    savemat(tmp_path / "h.mat", {"images": COUNTS})
    whole = (tmp_path / "h.mat").read_bytes()
    (tmp_path / "h.mat").write_bytes(whole[: len(whole) // 2])
    for name, content in (("e.mat", b"x" * 300), ("f.mat", b""), ("g.bin", b"x" * 300)):
        (tmp_path / name).write_bytes(content)
    for name in ("d.npy", "h.mat", "e.mat", "f.mat", "g.bin"):
        refused(tmp_path / name, "damaged|no HDF5 file|empty")
