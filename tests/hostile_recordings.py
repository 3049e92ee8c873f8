"""HDF5 files that mean harm: they lead to other files, or claim more than they hold."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

SECRET = "secret.txt"  #: the other file, 1024 bytes or more, in the folder above
IMAGES = np.zeros((4, 16, 16), np.uint16)
OUT, CLAIMS, NOWHERE = "leads to another file", "claims", "leads nowhere"


def write_hostile(kind: str, path: Path) -> Path:
    """Write a file of this kind."""
    with h5py.File(path, "w", track_order=False) as file:
        HOSTILE[kind][0](file)
    if kind == "link of an unknown kind":
        content = bytearray(path.read_bytes())
        at = content.rindex(b"extra") - 3  # version, flags, kind, charset, length of the name
        at = content.rindex(bytes([h5py.h5l.TYPE_EXTERNAL]), at - 8, at + 2)
        content[at] = 77
        path.write_bytes(content)
    return path


def write_zeros(path: Path, frames: int) -> Path:
    """Write a recording of zeros, which takes seconds to read and a moment to write."""
    with h5py.File(path, "w") as file:
        images = file.create_dataset(
            "frames", (frames, 16, 16), np.int64, chunks=(2048, 16, 16), compression=9
        )
        images[:2048] = 0
        mask, chunk = images.id.read_direct_chunk((0, 0, 0))
        for first in range(2048, frames, 2048):
            images.id.write_direct_chunk((first, 0, 0), chunk, mask)
    return path


def _external_storage(file: h5py.File) -> None:
    file.create_dataset("frames", (4, 16, 16), np.uint8, external=[(f"../{SECRET}", 0, 1024)])


def _hidden_storage(file: h5py.File) -> None:
    file["frames"] = IMAGES
    file.create_dataset("a/b/wrist", (4, 4), np.uint8, external=[(f"../{SECRET}", 0, 16)])


def _external_link(file: h5py.File) -> None:
    file["frames"] = h5py.ExternalLink(f"../{SECRET}", "/frames")


def _hidden_link(file: h5py.File) -> None:
    file["frames"] = IMAGES
    file.create_group("a/b")["c"] = h5py.ExternalLink("other.h5", "/")


def _unknown_link(file: h5py.File) -> None:
    file["frames"] = IMAGES
    file["extra"] = h5py.ExternalLink("other.h5", "/")


def _soft_link_out(file: h5py.File) -> None:
    file.create_group("a")["b"] = h5py.ExternalLink("other.h5", "/")
    file["frames"] = h5py.SoftLink("/a/b/frames")


def _dangling(file: h5py.File) -> None:
    file["frames"] = h5py.SoftLink("/nowhere")


def _recursive(file: h5py.File) -> None:
    file["frames"] = h5py.SoftLink("/pose")
    file["pose"] = h5py.SoftLink("/frames")


def _virtual(source: str, length: int | None) -> Callable[[h5py.File], None]:
    def build(file: h5py.File) -> None:
        shape = {"shape": (4, 16, 16), "maxshape": (length, 16, 16), "dtype": np.uint16}
        layout, part = h5py.VirtualLayout(**shape), np.s_[: length or h5py.h5s.UNLIMITED]
        layout[part] = h5py.VirtualSource(source, "frames", **shape)[part]
        file.create_virtual_dataset("frames", layout)

    return build


def _claimed(frames: int, **how: object) -> Callable[[h5py.File], None]:
    def build(file: h5py.File) -> None:
        file.create_dataset("frames", (frames, 16, 16), np.uint16, **how)

    return build


def _claimed_beside(file: h5py.File) -> None:
    """Write all images, and times that claim more."""
    file["frames"] = IMAGES
    file.create_dataset("t_ns", (10**9,), np.int64, chunks=(64,))


def _packed_twice(file: h5py.File) -> None:
    made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    made.set_chunk((4, 16, 16))
    made.set_deflate(1)
    made.set_fletcher32()
    made.set_deflate(9)
    space = h5py.h5s.create_simple(IMAGES.shape)
    h5py.h5d.create(file.id, b"frames", h5py.h5t.NATIVE_UINT16, space, dcpl=made)


def _first_chunk_only(file: h5py.File) -> None:
    file.create_dataset("frames", (10**9, 16, 16), np.uint16, chunks=(64, 16, 16))[0] = 1


def _deep(file: h5py.File) -> None:
    group = file
    for _ in range(100):
        group = group.create_group("a")
    file["frames"] = IMAGES


def _many(file: h5py.File) -> None:
    file["frames"] = IMAGES
    for number in range(10_001):
        file[f"s{number}"] = h5py.SoftLink("/frames")


#: name: how it is built, what is said of it
HOSTILE: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "external storage": (_external_storage, f"/frames {OUT}"),
    "external storage in a group": (_hidden_storage, f"/a/b/wrist {OUT}"),
    "external link": (_external_link, f"/frames {OUT}"),
    "external link in a group": (_hidden_link, f"/a/b/c {OUT}"),
    "link of an unknown kind": (_unknown_link, f"/extra {OUT}"),
    "soft link through an external one": (_soft_link_out, f"/a/b {OUT}"),
    "dangling link": (_dangling, f"/frames is a link that {NOWHERE}"),
    "recursive link": (_recursive, f"is a link that {NOWHERE}"),
    "virtual dataset": (_virtual("other.h5", 4), f"/frames {OUT}"),
    "virtual dataset without end": (_virtual("other.h5", None), f"/frames {OUT}"),
    "virtual dataset of itself": (_virtual(".", 4), f"/frames {OUT}"),
    "10^6 images": (_claimed(10**6, chunks=(64, 16, 16)), f"/frames {CLAIMS} 1000000 x 16 x 16"),
    "10^9 images": (_claimed(10**9, chunks=(64, 16, 16)), f"/frames {CLAIMS} 1000000000 x 16"),
    "10^9 images in a piece": (_claimed(10**9), f"/frames {CLAIMS} 1000000000 x 16"),
    "10^9 images, 64 written": (_first_chunk_only, f"/frames {CLAIMS} 1000000000 x 16"),
    "10^9 times": (_claimed_beside, f"/t_ns {CLAIMS} 1000000000 values"),
    "chunks of one value": (_claimed(10**4, chunks=(1, 1, 1)), f"/frames {CLAIMS} 10000 x 16"),
    "chunks of 512 MB": (
        _claimed(9, chunks=(10**6, 16, 16), maxshape=(None, 16, 16)),
        "/frames is stored in chunks of 512,000,000 bytes, 67,108,864 can be read",
    ),
    "packed twice": (_packed_twice, "/frames is packed twice"),
    "groups in groups": (_deep, "groups 64 deep"),
    "10,002 objects": (_many, "more than 10,000 objects"),
}
