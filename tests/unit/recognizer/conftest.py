"""Labs that are encoded, and one small enough to be gone through place by place."""

from types import SimpleNamespace

import numpy as np
import pytest

from generator.pipeline import encode
from generator.spec import read_specs
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.symbols.fit import Fit

PITCH = 7.0


class SmallLab:
    """An array of any labels, and which cells are registered.

    `held` is (row, column) -> (face, label); the array goes round, 11 x 13 by default.
    """

    def __init__(self, held, rows=11, columns=13, order=4):
        self.held, self.rows, self.columns, self.order = held, rows, columns, order
        cells = sorted(held)
        keys = np.array([r * columns + c for r, c in cells], np.uint64)
        owners = [held[cell][0] for cell in cells]
        self.embossed = EmbossedArray(
            array=SimpleNamespace(rows=rows, columns=columns, order=order),
            alphabet=None,
            style=SimpleNamespace(pitch_mm=PITCH, height_mm=1.2, stroke_mm=1.4),
            keys=keys,
            owners=np.array([*owners, -1], np.int32),
            labels=np.array([*(held[cell][1] for cell in cells), -1], np.int8),
            dense=None,
            faces=np.array([[1, face] for face in range(max(owners) + 1)]),
            names={1: "Thing"},
            engine=None,
        )

    def shows(self, row, column, face, cells):
        """What lattice cells (i, j) show if (0, 0) lies at a place of a face; `order`: none."""
        found = []
        for i, j in cells:
            at = (row - j) % self.rows, (column + i) % self.columns
            owner, label = self.held.get(at, (None, None))
            found.append(label if owner == face else self.order)
        return found

    def places(self, cells):
        """Every (row, column, face) at which some of the cells are registered."""
        return {
            ((r + j) % self.rows, (c - i) % self.columns, face)
            for (r, c), (face, _) in self.held.items()
            for i, j in cells
        }


def two_faces():
    """A face of 6 x 6 cells, and one of 3 x 4 that lies over the array's corner."""
    labels = np.random.default_rng(20).integers(0, 4, (11, 13))
    held = {(r, c): (0, int(labels[r, c])) for r in range(1, 7) for c in range(2, 8)}
    held |= {(r, c): (1, int(labels[r, c])) for r in (9, 10, 0) for c in (11, 12, 0, 1)}
    return SmallLab(held)


def fit_of(cells, scores, seen=20.0, **changed):
    """A fit that sees cells (i, j) with scores (m, q + 1)."""
    values = {
        "x_mm": 0.0,
        "y_mm": 0.0,
        "theta_rad": 0.0,
        "nuisance": np.zeros(4),
        "gain": np.zeros(4),
        "cells": np.array(cells, np.int64).reshape(-1, 2),
        "scores": np.array(scores, float),
        "seen": np.broadcast_to(np.array(seen, float), len(cells)).copy(),
        "noise": 0.1,
        "value": 0.0,
        "covariance": np.eye(3),
    }
    return Fit(**(values | changed))


def known_face(name, face, **changed):
    """A registered face of 42 x 42 mm; cell (6, 2) of the array is at its origin."""
    plain = {
        "object": name, "face": face, "round": None, "T_object_face": np.eye(4), "printed": None,
        "polygon_mm": (np.array([(0, 0), (42, 0), (42, 42), (0, 42)], float),),
        "rows": np.array([6]), "columns": np.array([2]), "rotation_rad": 0.0,
        "centres_mm": np.array([[3.5, 3.5]]),
    }  # fmt: skip
    return SimpleNamespace(**plain | changed)


def sure_of(labels, order=4, least=-12.0):
    """Scores of cells that show these labels beyond doubt (`order`: no symbol)."""
    return np.where(np.array(labels)[:, None] == np.arange(order + 1), 0.0, least)


@pytest.fixture
def small():
    """What the lab and its fits are built with."""
    built = {one.__name__: one for one in (two_faces, fit_of, sure_of, known_face)}
    return SimpleNamespace(Lab=SmallLab, **built)


@pytest.fixture(scope="session")
def make_lab(tmp_path_factory):
    """Encode what YAML specs say; return the folder of `lab.db` and the files."""

    def make(*specs, formats=(), **options):
        folder = tmp_path_factory.mktemp("lab")
        for spec in specs:
            (folder / "spec.yaml").write_text(spec)
            url = f"sqlite:///{folder / 'lab.db'}"
            specs_read = read_specs([folder / "spec.yaml"])
            encode(specs_read, folder=folder / "parts", database=url, formats=formats, **options)
        return folder

    return make
