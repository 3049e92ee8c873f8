"""The thesis's image: filters, skeletons, symbols, the grid that they stand on, edges, corners."""

import itertools
import math

import numpy as np
import pytest
from scipy import ndimage

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
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
from recognizer.thesis.filters import magnify_image, median, sobel
from recognizer.thesis.grid import grid
from recognizer.thesis.merge import magnify_samples
from recognizer.thesis.skeleton import points_of_glyph, points_of_skeleton
from recognizer.thesis.symbols import COUNTS, CUT, Symbol, symbols
from recognizer.touch.tactile_image import ImageError, tactile_image, touch_image

STEP = 0.4
PITCH = 12.0
LABELS = np.array([[0, 1, 1, 0], [1, 1, 0, 0], [0, 1, 0, 1]])


def noise(seed=0, shape=(16, 16)):
    return np.random.default_rng(seed).uniform(0, 1, shape)


def test_frame_has_x_along_columns_and_y_against_rows():
    sensor = SensorType()
    image = touch_image(sensor, noise())
    assert image.xy_mm(*np.indices((16, 16))) == pytest.approx(sensor.centres_mm(), abs=1e-12)
    fine = magnify_image(image)
    assert fine.xy_mm(0, 0) == pytest.approx(image.xy_mm(0, 0))
    assert fine.xy_mm(60, 60) == pytest.approx(image.xy_mm(15, 15))


@pytest.mark.parametrize(
    ("values", "kwargs", "match"),
    [
        (np.zeros(5), {"step_mm": 1}, "shape"),
        (np.zeros((4, 4)), {"step_mm": 0}, "step"),
        (np.zeros((4, 4)), {"step_mm": 1, "defined": np.ones((3, 4))}, "mask"),
        (np.full((4, 4), np.nan), {"step_mm": 1}, r"16 readings.*\(0, 0\)"),
    ],
)
def test_no_image_is_refused(values, kwargs, match):
    with pytest.raises(ImageError, match=match):
        tactile_image(values, **kwargs)


def test_median_takes_spikes_and_keeps_edges_but_erases_thin_lines():
    spiked = np.where(np.arange(16) >= 8, 1.0, np.zeros((16, 16)))
    step = tactile_image(spiked.copy(), step_mm=1.0)
    spiked[4, 3] = 9
    assert np.array_equal(median(tactile_image(spiked, step_mm=1.0)).values, step.values)
    line = tactile_image(np.where(np.arange(16) == 8, 1.0, np.zeros((16, 16))), step_mm=1.0)
    assert not median(line).values.any()
    with pytest.raises(ImageError, match="erases lines"):
        median(line, thinnest_mm=1.5)


def test_sobel_is_scipys_with_y_against_rows():
    values = noise(5)
    x, y = sobel(tactile_image(values, step_mm=0.5))
    assert x == pytest.approx(ndimage.sobel(values, axis=1, mode="nearest") / 4)
    assert y == pytest.approx(-ndimage.sobel(values, axis=0, mode="nearest") / 4)


def test_magnification_is_the_thesis_convolution():
    """Zeros between the tactels and H, twice; the last three rows and columns are beyond."""
    values, h = noise(4), np.outer([0.5, 1.0, 0.5], [0.5, 1.0, 0.5])
    wanted = values
    for _ in range(2):
        wide = np.zeros((2 * len(wanted), 2 * len(wanted)))
        wide[::2, ::2] = wanted
        wanted = ndimage.convolve(wide, h, mode="constant")
    assert magnify_samples(values) == pytest.approx(wanted, abs=1e-12)
    fine = magnify_image(tactile_image(values, step_mm=1.0))
    assert fine.values.shape == (61, 61)
    assert fine.step_mm == 0.25
    assert fine.values == pytest.approx(wanted[:61, :61], abs=1e-12)


def style(alphabet):
    return SymbolStyle(PITCH, 1.0, stroke_mm=alphabet.stroke_ratio * PITCH, draft_rad=0.17)


def drawn(alphabet, placed, size_mm=50.0, pitch=12.0, half_mm=None):
    """An image of (label, x, y, theta), strokes with soft sides."""
    n = round(size_mm / STEP)
    at = (np.arange(n) - (n - 1) / 2) * STEP
    z = at[None, :] - 1j * at[:, None]
    half = alphabet.stroke_ratio * pitch / 2 if half_mm is None else half_mm
    image = np.zeros((n, n))
    unit = alphabet.reach * pitch
    for label, x, y, theta in placed:
        own = (z - complex(x, y)) * np.exp(-1j * theta)
        for a, b in alphabet.glyphs[label].strokes:
            p, u = complex(*a) * unit, (complex(*b) - complex(*a)) * unit
            t = np.clip(((own - p) * u.conjugate()).real / abs(u) ** 2, 0, 1)
            image = np.maximum(image, np.clip((half + 0.4 - abs(own - p - t * u)) / 0.8, 0, 1))
    return tactile_image(image, step_mm=STEP)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("thesis-2", [(2, 1, 0), (3, 2, 0)]),  # thesis, figure 6.4
        ("dense-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),  # figure 6.12
        ("letters-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),
    ],
)
def test_glyphs_have_the_end_points_and_vertices_of_the_thesis(name, expected):
    assert [points_of_glyph(glyph).counts for glyph in alphabet_named(name).glyphs] == expected


def test_a_ring_is_one_loop_without_ends():
    ring = np.zeros((5, 5), bool)
    ring[[1, 2, 2, 3], [2, 1, 3, 2]] = True
    assert points_of_skeleton(ring, 100.0).counts == (0, 0, 1)


@pytest.mark.parametrize("name", ["thesis-2", "letters-4"])
@pytest.mark.parametrize("degrees", [0, 17, 45, 133, 290])
def test_symbols_are_named_placed_and_turned(name, degrees):
    alphabet = alphabet_named(name)
    theta = math.radians(degrees)
    for label in range(alphabet.order):
        image = drawn(alphabet, [(label, 1.3, -2.2, theta)], size_mm=24)
        (found,) = symbols(image, alphabet, style(alphabet))
        assert found.label == label
        assert math.hypot(found.x_mm - 1.3, found.y_mm + 2.2) < 0.5
        assert abs(math.remainder(found.theta_rad - theta, math.tau)) < math.radians(8)


def test_what_is_no_symbol_is_rejected_with_a_reason():
    two, four = alphabet_named("thesis-2"), alphabet_named("letters-4")
    assert symbols(tactile_image(np.zeros((40, 40)), step_mm=STEP), two, style(two)) == []
    bar = np.zeros((60, 60))
    bar[28:32, 10:40] = 1
    wide = drawn(four, [(0, 0, 0, 0.0)], size_mm=40, pitch=22.0, half_mm=0.9)
    for image, alphabet, reason in (
        (tactile_image(bar, step_mm=STEP), two, COUNTS),
        (drawn(two, [(0, 10.5, 0, 0.0)], size_mm=24), two, CUT),
        (wide, four, "shape"),
    ):
        (found,) = symbols(image, alphabet, style(alphabet))
        assert (found.label, found.rejected) == (-1, reason)


def symbol(x, y, theta, label=0):
    rejected = "" if label >= 0 else "counts"
    return Symbol(label, x, y, theta, (x, y), 0.1, rejected)


def laid(away):
    """Symbols of LABELS, each away from its place and turned: x, y, mm, and rad."""
    (r, c), (x, y, turns) = np.indices(LABELS.shape).reshape(2, -1), np.reshape(away, (-1, 3)).T
    places = zip(PITCH * c + x, y - PITCH * r, turns, LABELS.ravel().tolist(), strict=True)
    return [symbol(*place) for place in places]


def test_a_symbol_is_off_by_a_quarter_of_the_pitch_at_most():
    for away, members in ((2.9, 2), (3.1, 1)):
        found = grid([symbol(0, 0, 0.0), symbol(PITCH + away, 0, 0.0)], PITCH)
        assert len(found.members) == members
    assert grid([symbol(0, 0, 0.0, label=-1)], PITCH) is None


def test_the_covariance_holds_what_happens():
    rng, normed = np.random.default_rng(1), []
    truth = grid(laid(np.zeros((12, 3))), PITCH)
    for _ in range(60):
        found = grid(laid(rng.normal(0, (0.2, 0.2, math.radians(4)), (12, 3))), PITCH)
        i, j = np.subtract(found.first, truth.first) * PITCH  # cells are numbered from any symbol
        x, y = found.x_mm - i - truth.x_mm, found.y_mm - j - truth.y_mm
        error = np.array([x, y, found.theta_rad - truth.theta_rad])
        normed.append(error @ np.linalg.solve(found.covariance, error))
    assert 1.5 < np.mean(normed) < 4.5  # chi square of 3 freedoms


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


def touches(loop, places, rng):
    """Readings of a sensor with defects on a blank face."""
    face = FaceSurface(None, polygon([np.asarray(loop, float)]))
    for x, y in places:
        touch = Touch(x, y, rng.uniform(-math.pi, math.pi), rng.uniform(30, 110),
                      *rng.normal(0, 0.01, 2))  # fmt: skip
        tips = Tips(lengths_mm=rng.normal(0, 0.03, (16, 16)))
        felt = tabs(face, SENSOR, touch, tips).forces_n * np.exp(rng.normal(0, 0.1, (16, 16)))
        yield touch, touch_image(SENSOR, np.maximum(felt + rng.normal(0, 0.02, (16, 16)), 0))


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
