"""Images as other programmes write them: a table of numbers, or a folder of pictures.

A CSV holds an image a line (rows * columns numbers, row 0 first; a head line is passed over,
and where it names `r0c0`, `r0c1`, ... as our own tables do, those columns are taken), or one
image (rows lines of columns numbers). A folder holds a grey picture an image, in the order of
their names. Each becomes a `FileArray`, as arrays in files do.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from probe.errors import RecordingError
from probe.recording.arrays import FileArray
from probe.recording.opened import explain_errors
from probe.recording.table import table_header

SUFFIXES = (".png", ".pgm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")


def folder_array(folder: Path, image: tuple[int, int]) -> FileArray:
    """Return the pictures of a folder as one array; each is read when it is asked for.

    Raises
    ------
    RecordingError
        No pictures in it, or one that is of another size, in colours, or damaged.
    """
    with explain_errors(folder, "read"):
        paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise RecordingError(
            "no picture in the folder", fix=f"put {', '.join(SUFFIXES)} there", place=str(folder)
        )
    for path in paths:
        _picture(path, image)

    def part(slices: tuple[slice, ...]) -> NDArray[Any]:
        return np.stack([_picture(path, image) for path in paths[slices[0]]])[:, *slices[1:]]

    return FileArray(folder.name, (len(paths), *image), np.dtype(np.float64), part)


def table_array(path: Path, image: tuple[int, int]) -> FileArray:
    """Return the images of a table of numbers.

    Raises
    ------
    RecordingError
        No numbers, or lines that are no image.
    """
    with explain_errors(path, "read"):
        try:
            with open(path, encoding="utf-8-sig", newline="") as file:
                lines = [line for line in csv.reader(file) if any(cell.strip() for cell in line)]
        except (UnicodeError, csv.Error) as bad:
            raise RecordingError(
                f"it is no table: {bad}", fix="save it as CSV, UTF-8", place=str(path)
            ) from bad
    head = [] if not lines or _are_numbers(lines[0]) else [name.strip() for name in lines.pop(0)]
    wanted = [name for name in table_header(image) if name.startswith("r")]
    if all(name in head for name in wanted):
        columns = [head.index(name) for name in wanted]
        lines = [[line[c] for c in columns] if len(line) == len(head) else line for line in lines]
    values = _numbers(path, lines, bool(head))
    rows, columns_ = image
    if values.shape == image:
        values = values[None]
    elif values.ndim == 2 and values.shape[1] == rows * columns_:
        values = values.reshape(-1, rows, columns_)
    else:
        raise RecordingError(
            f"lines of {values.shape[-1]} numbers are no images of {rows} x {columns_}",
            fix=f"write {rows * columns_} numbers a line, or give the --sensor-type",
            place=str(path),
        )
    return FileArray(path.stem, values.shape, values.dtype, lambda slices: values[slices])


def _picture(path: Path, image: tuple[int, int]) -> NDArray[np.float64]:
    from PIL import Image, UnidentifiedImageError

    with explain_errors(path, "read"):
        try:
            with Image.open(path) as opened:
                values = np.asarray(opened)
        except (UnidentifiedImageError, SyntaxError) as bad:
            raise RecordingError(
                "it is no picture, or it is damaged", fix="save it again", place=str(path)
            ) from bad
    if values.shape != image or values.dtype.kind not in "uif":
        raise RecordingError(
            f"a picture of {' x '.join(map(str, values.shape))}, not of "
            f"{image[0]} x {image[1]} grey values",
            fix="save it in grey, a pixel a tactel; or give the --sensor-type",
            place=str(path),
        )
    return values.astype(np.float64)


def _are_numbers(cells: list[str]) -> bool:
    try:
        [float(cell) for cell in cells]
    except ValueError:
        return False
    return True


def _numbers(path: Path, lines: list[list[str]], headed: bool) -> NDArray[np.float64]:
    width = len(lines[0]) if lines else 0
    for number, line in enumerate(lines, 2 if headed else 1):
        if len(line) != width or not _are_numbers(line):
            raise RecordingError(
                f"not {width} numbers as in the lines before",
                fix="write numbers with commas between, as many in each line",
                place=f"{path}:{number}",
            )
    if not lines:
        raise RecordingError("it holds no numbers", fix="write an image a line", place=str(path))
    return np.array([[float(cell) for cell in line] for line in lines])
