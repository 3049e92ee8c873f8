"""Edges and corners: Hough, production rules, and the fit on simulated touches."""

import itertools
import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.surface.face import FaceSurface
from probe.surface.polygon import polygon
from recognizer.thesis.edge_fit import face_edges
from recognizer.thesis.edges import (
    EdgePoints,
    classical_edges,
    fit_line,
    fuse_segments,
    segments,
    vertices,
)
from recognizer.touch.tactile_image import touch_image

SENSOR = SensorType()
SQUARE = np.array([[0.0, 0], [80, 0], [80, 80], [0, 80]])
THESIS_MM = 1.52  # the thesis's largest error of an edge


def on_line(angle, offset, along, rng, across=0.1):
    n = np.array([math.cos(angle), math.sin(angle)])
    t = np.array([n[1], -n[0]])
    at = offset * n + np.asarray(along)[:, None] * t
    at = at + rng.normal(0, across, len(along))[:, None] * n
    return EdgePoints(at, np.tile(n, (len(at), 1)))


def joined(*parts):
    return EdgePoints(
        *(np.concatenate([getattr(p, name) for p in parts]) for name in EdgePoints.__slots__)
    )


# --- points, lines, segments ------------------------------------------------------------


@pytest.mark.parametrize("degrees", range(-180, 180, 120))
def test_line_through_points_and_its_covariance(degrees):
    rng, angle = np.random.default_rng(degrees + 180), math.radians(degrees)
    normed = []
    for _ in range(40):
        points = on_line(angle, 3.0, np.linspace(2, 14, 15), rng, 0.2)
        edge = fit_line(points.at_mm, points.normals)
        error = np.array([math.remainder(edge.angle_rad - angle, math.tau), edge.offset_mm - 3.0])
        normed.append(error @ np.linalg.solve(edge.covariance, error))
        way = edge.end_mm - edge.start_mm
        assert edge.normal @ (-way[1], way[0]) > 0  # the face to the left
    assert 0.8 < np.mean(normed) < 4.5


def test_longest_segment_is_taken_first_and_noise_is_none():
    rng = np.random.default_rng(1)
    long = on_line(0.5, 4.0, np.linspace(-10, 10, 30), rng)
    short = on_line(-1.2, -6.0, np.linspace(0, 6, 10), rng)
    specks = EdgePoints(rng.uniform(-12, 12, (12, 2)), rng.normal(0, 1, (12, 2)) * 0.1 + [0, 1])
    found = segments(joined(short, specks, long))
    assert found[0].edge.angle_rad == pytest.approx(0.5, abs=0.02)
    assert found[0].edge.offset_mm == pytest.approx(4.0, abs=0.1)
    assert len(found[0].points) >= 29
    assert found[1].edge.offset_mm == pytest.approx(-6.0, abs=0.2)
    lengths = [segment.edge.length_mm for segment in found]
    assert lengths == sorted(lengths, reverse=True)
    assert segments(joined(short).chosen(np.arange(2))) == []
    against = EdgePoints(long.at_mm, -long.normals)  # slopes that look against each other
    assert len(segments(joined(long, against))) == 2


# --- production rules -------------------------------------------------------------------


def test_edges_that_turn_make_a_vertex_and_parallel_ones_none():
    rng = np.random.default_rng(4)
    below = on_line(math.pi / 2, -5.0, np.linspace(-9, 5, 20), rng, 0.02)
    left = on_line(0.0, -6.0, np.linspace(-9, 5, 20), rng, 0.02)
    edges = fuse_segments(segments(joined(below, left)))
    (corner,) = vertices(edges)
    assert corner == pytest.approx([-6.0, -5.0], abs=0.1)
    far = on_line(0.02, 8.0, np.linspace(-9, 5, 20), rng, 0.02)
    across = next(edge for edge in edges if abs(edge.angle_rad) < 0.1)
    assert vertices([across, fit_line(far.at_mm, far.normals), across]) == []


# --- simulated touches ------------------------------------------------------------------


def touches(loop, places, rng, gain=0.1, noise=0.02, length=0.03):
    """Readings of a sensor with defects on a blank face."""
    face = FaceSurface(None, polygon([np.asarray(loop, float)]))
    for x, y in places:
        touch = Touch(x, y, rng.uniform(-math.pi, math.pi), rng.uniform(30, 110),
                      *rng.normal(0, 0.01, 2))  # fmt: skip
        tips = Tips(lengths_mm=rng.normal(0, length, (16, 16)))
        felt = tabs(face, SENSOR, touch, tips).forces_n * np.exp(rng.normal(0, gain, (16, 16)))
        yield touch, touch_image(SENSOR, np.maximum(felt + rng.normal(0, noise, (16, 16)), 0))


def truth(touch, a, b):
    """Angle and offset of the edge from a to b, face to the left, in the sensor frame."""
    way = np.subtract(b, a) / np.linalg.norm(np.subtract(b, a))
    normal = np.array([-way[1], way[0]])
    angle = math.atan2(normal[1], normal[0]) - touch.theta_rad
    return angle, float(normal @ (np.asarray(a, float) - (touch.x_mm, touch.y_mm)))


def worst_mm(edge, angle, offset):
    n = np.array([math.cos(angle), math.sin(angle)])
    return max(abs(float(n @ end) - offset) for end in (edge.start_mm, edge.end_mm))


def test_an_edge_is_found_to_a_fraction_of_the_thesis_error():
    rng = np.random.default_rng(5)
    places = zip(rng.uniform(-5, 8, 20), rng.uniform(25, 55, 20), strict=True)
    classical, ours, inside = [], [], 0
    for touch, image in touches(SQUARE, places, rng):
        angle, offset = truth(touch, (0, 80), (0, 0))
        rough = classical_edges(image)
        classical.append(min(worst_mm(edge, angle, offset) for edge in rough))
        edges = face_edges(image, SENSOR)
        for edge in edges[:1]:
            ours.append(worst_mm(edge, angle, offset))
            turn = math.remainder(edge.angle_rad - angle, math.tau)
            error = np.array([turn, edge.offset_mm - offset])
            inside += error @ np.linalg.solve(edge.covariance, error) < 9.2  # 99 %
    assert len(ours) >= 18
    assert np.sqrt(np.mean(np.square(ours))) < THESIS_MM / 6
    assert np.median(ours) < THESIS_MM / 12
    assert inside >= 0.85 * len(ours)
    assert max(classical) < THESIS_MM


def test_a_corner_is_found_with_both_edges():
    rng = np.random.default_rng(6)
    places = itertools.product((2.0, 5.0, 8.0), (2.5, 5.5, 8.5))
    errors = []
    for touch, image in touches(SQUARE, places, rng):
        found = vertices(face_edges(image, SENSOR))
        if len(found) == 1:
            c, s = math.cos(touch.theta_rad), math.sin(touch.theta_rad)
            at = (-c * touch.x_mm - s * touch.y_mm, s * touch.x_mm - c * touch.y_mm)
            errors.append(math.dist(at, found[0]))
    assert len(errors) >= 7
    assert np.median(errors) < 0.3


def test_no_edge_in_an_even_image_or_where_the_face_reaches_everywhere():
    inside = touches(SQUARE, [(40, 40), (30, 50), (50, 35)], np.random.default_rng(8))
    even = [touch_image(SENSOR, np.full((16, 16), level)) for level in (0.0, 5.0)]
    for image in [*even, *(image for _, image in inside)]:
        assert face_edges(image, SENSOR) == ()


def test_where_the_face_goes_round_a_corner_both_sides_of_it_are_felt():
    loop = [[0, 0], [80, 0], [80, 40], [40, 40], [40, 80], [0, 80]]
    rng, found = np.random.default_rng(7), 0
    for touch, image in touches(loop, [(37, 37), (36, 40), (39, 36), (38, 38)], rng):
        edges = face_edges(image, SENSOR)
        if vertices(edges):
            lines = truth(touch, (80, 40), (40, 40)), truth(touch, (40, 40), (40, 80))
            assert max(min(worst_mm(edge, *line) for edge in edges) for line in lines) < 0.5
            found += 1
    assert found >= 2


def test_dead_tactels_are_left_out():
    ((touch, image),) = touches(SQUARE, [(3, 40)], np.random.default_rng(9))
    trust = (np.random.default_rng(2).random((16, 16)) > 0.03).astype(float)
    edge = face_edges(touch_image(SENSOR, image.values * trust, trust), SENSOR)[0]
    assert worst_mm(edge, *truth(touch, (0, 80), (0, 0))) < 0.5
