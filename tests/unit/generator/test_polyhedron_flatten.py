"""Vertices typed with a few decimals are moved onto the planes of their faces."""

import numpy as np
import pytest

from generator.polyhedron import SHAPES, flatten
from generator.polyhedron.flatten import flatten_faces


def rounded_dodecahedron():
    solid = SHAPES["dodecahedron"](side=30)
    return np.round(solid.vertices, 3), [face.loops for face in solid.faces]


def bend(vertices, faces):
    worst = 0.0
    for (loop,) in faces:
        points = vertices[list(loop)] - vertices[list(loop)].mean(axis=0)
        worst = max(worst, np.linalg.svd(points)[1][2])
    return worst


def test_many_equations_are_solved_as_few(monkeypatch):
    vertices, faces = rounded_dodecahedron()
    dense, _ = flatten_faces(vertices, faces)
    monkeypatch.setattr(flatten, "DENSE_EQUATIONS", 10)
    sparse, _ = flatten_faces(vertices, faces)
    assert bend(sparse, faces) < 1e-12
    assert sparse == pytest.approx(dense, abs=1e-9)
    assert (sparse != vertices).any()
    monkeypatch.setattr(flatten, "DENSE_EQUATIONS", 10)
    monkeypatch.setattr(flatten, "MOST_EQUATIONS", 20)
    assert (flatten_faces(vertices, faces)[0] == vertices).all()


def test_planar_enough_for_parts_stays_as_given_where_there_are_many(monkeypatch):
    solid = SHAPES["dodecahedron"](side=30)
    faces = [face.loops for face in solid.faces]
    vertices = solid.vertices + 1e-10 * np.random.default_rng(3).normal(size=solid.vertices.shape)
    assert flatten_faces(vertices, faces)[1] > 0.0
    monkeypatch.setattr(flatten, "DENSE_EQUATIONS", 10)
    assert flatten_faces(vertices, faces)[1] == 0.0
