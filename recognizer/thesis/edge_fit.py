"""Edges of the face in one touch, fitted to its readings. Thesis 3.3, 4.2, 4.3.

The thesis's edges (`edges`) are moved until they explain the readings of the tactels themselves,
several times as precise. On faces with symbols only the symbols press, so edges are theirs.

Response of a tactel at the edge of a flat face, as a function of how far its centre lies inside: 0
where the face does not reach, 1 well inside it. A tab responds by the share of its round tip that
lies on the face, and a little more because a partly covered tip bulges into the open; between two
tabs, an edge has no effect. A pad's tactel responds by a share of its square, smeared by the pad.
Cross-talk and rounded edges blur both.

Fit: the face presses as p(x, y) = exp(a quadratic form), which follows a tilted plate and an
overlay that hardens; a tactel reads p times its response to every edge near it. In turns, p is
fitted to the tactels well inside, and the edges by least squares to the readings over p near them,
each weighted by its precision; the blur is the one that explains most. Readings are good to a share
of themselves (gains of tactels) and to a floor (noise).

Where the face goes round a corner (opening over pi), a tactel is on the face if it is inside of
one of the two edges; else it must be inside of both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.edges import Edge, classical_edges
from recognizer.thesis.filters import subtract_bias
from recognizer.touch.signal import Signal
from recognizer.touch.tactile_image import TactileImage, touch_image

Array = NDArray[np.float64]

# Response
STEP_MM = 0.05  #: between the distances of a table
REACH_MM = 6.0  #: beyond, responses are 0 or 1
BLURS_MM = (0.1, 0.4, 0.75)  #: standard deviations that are tabulated
BULGE = 0.59  #: F(c) / F(1) = c (1 + bulge (1 - c)) of a tip covered by the share c
PAD_BLUR = 0.5  #: standard deviation, of the pad's thickness

# Fit
ROUNDS = 3  #: of pressure and edges in turns
STEPS = 3  #: of the edges in each
BAND_MM = 3.0  #: from an edge, within which tactels define it
INNER_MM = 1.2  #: inside, from which tactels define the pressure
GAIN = 0.15  #: standard deviation of tactels' gains
FLOOR = 0.07  #: of noise and of displaced tabs, over the pressure
FARTHEST = 3.0  #: standard deviations, beyond which a reading counts ever less
MODEL_MM, MODEL_RAD = 0.06, math.radians(0.4)  #: standard deviations by the model alone
LEAST_TACTELS = 12  #: that define the pressure
SCALE_MM = 6.0  #: over which the pressure changes
#: step of derivatives, half the gap between two tabs: within it nothing changes
SLOPE_MM = 0.16
DAMPING = (30.0, 0.3)  #: of angle (1/rad^2) and offset (1/mm^2)
MOST_CHANGE = (0.1, 0.5)  #: of angle (rad) and offset (mm) in a step

# Acceptance
MOST_EDGES = 3  #: fitted at once
BEYOND = 0.15  #: most pressure beyond an edge, of that inside
FIRM = 0.25  #: least pressure inside an edge, of the highest
MOVED_MM = 2.0  #: most change by the fit, at the ends of the visible part
MOST_RESIDUAL = 3.0  #: rms residual, expected standard deviations


@dataclass(frozen=True, slots=True, eq=False)
class FittedEdges:
    """Edges that explain the readings of a touch."""

    edges: tuple[Edge, ...]  #: each with the covariance of its angle and offset
    off: float  #: rms residual, expected standard deviations


def touch_edges(sensor: SensorType, signal: Signal) -> tuple[Edge, ...]:
    """Return the edges of a touch by its signal, in the sensor frame.

    Of a face without symbols these are the edges of the face. Of one with symbols they are lines
    along which symbols end, and rare: symbols are no even plane.
    """
    if not signal.contact:
        return ()
    return face_edges(touch_image(sensor, signal.forces, signal.trust), sensor)


def face_edges(image: TactileImage, sensor: SensorType) -> tuple[Edge, ...]:
    """Return the edges of a blank face by the `touch_image` of a touch, in the sensor frame.

    Examples
    --------
    >>> from recognizer.touch.tactile_image import touch_image
    >>> readings = np.zeros((16, 16))
    >>> readings[:, 7:] = 0.5
    >>> edge, = face_edges(touch_image(SensorType(), readings), SensorType())
    >>> bool(abs(edge.angle_rad) < 0.02 and abs(edge.offset_mm + 1.5875) < 0.2)
    True
    """
    over = subtract_bias(image)
    rough = tuple(edge for edge in classical_edges(image) if _bounds(over, edge))[:MOST_EDGES]
    best = _best(over, sensor, rough) if rough else None
    if best is not None:
        kept = tuple(
            edge
            for edge, before in zip(best.edges, rough, strict=True)
            if _moved_mm(edge, before) <= MOVED_MM and _bounds(over, edge)
        )
        if len(kept) < len(rough):
            best = _best(over, sensor, kept) if kept else None
    return () if best is None or best.off > MOST_RESIDUAL else best.edges


def fit_edges(
    image: TactileImage,
    sensor: SensorType,
    edges: tuple[Edge, ...],
    reflex: bool,
    blurs_mm: Sequence[float] = BLURS_MM,
) -> FittedEdges | None:
    """Fit edges at once; None where too few tactels lie on the face.

    Parameters
    ----------
    image
        One touch over its bias, a sample to each tactel.
    edges
        Right within a tactel and ten degrees.
    reflex
        The face is inside of any edge, not of all edges.
    blurs_mm
        Of `BLURS_MM`, to try.
    """
    at = image.xy_mm(*np.indices(image.values.shape))[image.defined]
    readings = image.values[image.defined]
    tables = responses(sensor)
    start = np.array([[edge.angle_rad, edge.offset_mm] for edge in edges])
    fits = [
        _fit_with_blur(at, readings, tables[BLURS_MM.index(blur)], start, reflex)
        for blur in blurs_mm
    ]
    found = min((fit for fit in fits if fit is not None), key=lambda fit: fit[0], default=None)
    if found is None:
        return None
    cost, lines, information = found
    model = np.diag(np.tile([MODEL_RAD**2, MODEL_MM**2], len(lines)))
    covariance = np.asarray(np.linalg.pinv(information), np.float64)
    covariance = covariance * max(1.0, math.sqrt(cost)) ** 2 + model
    moved = tuple(
        _edge_on_line(edge, lines[k], covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2])
        for k, edge in enumerate(edges)
    )
    return FittedEdges(moved, math.sqrt(cost))


@lru_cache(maxsize=8)
def responses(sensor: SensorType) -> Array:
    """Return responses (blurs, n) at -reach_mm ... reach_mm inside, every step_mm."""
    from scipy.ndimage import gaussian_filter1d

    steps = round(REACH_MM / STEP_MM)
    inside = np.arange(-steps, steps + 1) * STEP_MM
    overlay = sensor.overlay
    if overlay.kind == "tab":
        t = np.clip(inside / (overlay.tab_diameter_mm / 2), -1, 1)
        cover = 0.5 + (np.arcsin(t) + t * np.sqrt(1 - t * t)) / np.pi
        tip = cover * (1 + BULGE * (1 - cover))
    else:
        share = np.clip(inside / sensor.pitch_mm + 0.5, 0, 1)
        tip = gaussian_filter1d(share, PAD_BLUR * overlay.height_mm / STEP_MM, mode="nearest")
    table = np.array([gaussian_filter1d(tip, b / STEP_MM, mode="nearest") for b in BLURS_MM])
    table.setflags(write=False)
    return table


def response_at(table: Array, inside_mm: Array) -> Array:
    """Return one row of `responses` at distances of any shape."""
    place = np.clip((inside_mm + REACH_MM) / STEP_MM, 0, len(table) - 1)
    k = np.minimum(place.astype(np.intp), len(table) - 2)
    share = place - k
    return np.asarray(table[k] * (1 - share) + table[k + 1] * share)


def _best(image: TactileImage, sensor: SensorType, edges: tuple[Edge, ...]) -> FittedEdges | None:
    """Return the fit of a face inside of all edges, or of any, whichever explains more."""
    reflex = False
    if len(edges) > 1:
        ways = [fit_edges(image, sensor, edges, way, BLURS_MM[1:2]) for way in (False, True)]
        off = [math.inf if way is None else way.off for way in ways]
        reflex = off[1] < off[0]
    return fit_edges(image, sensor, edges, reflex)


def _bounds(image: TactileImage, edge: Edge) -> bool:
    """Whether the pressed face ends here.

    Folds have pressure beyond them; where the plate lifts off the face, there is hardly any inside.
    """
    at = image.xy_mm(*np.indices(image.values.shape))
    inside = edge.inside_mm(at) / image.step_mm
    way = (edge.end_mm - edge.start_mm) / max(edge.length_mm, 1e-9)
    along = (at - edge.start_mm) @ way
    along_edge = image.defined & (along > 0) & (along < edge.length_mm)
    outer, inner = (along_edge & (side > 0.8) & (side < 3.0) for side in (-inside, inside))
    if not (outer.any() and inner.any()):
        return False
    pressed = float(np.median(image.values[inner]))
    most = float(np.quantile(image.values[image.defined & (image.values > 0)], 0.9))
    beyond = float(np.median(image.values[outer]))
    return pressed >= FIRM * most and beyond <= BEYOND * pressed


def _moved_mm(edge: Edge, before: Edge) -> float:
    ends = np.stack([before.start_mm, before.end_mm])
    return float(np.abs(edge.inside_mm(ends)).max())


def _fit_with_blur(
    at: Array, readings: Array, table: Array, lines: Array, reflex: bool
) -> tuple[float, Array, Array] | None:
    """Return the mean cost, lines and information (2 k, 2 k) with one blur."""
    information = np.zeros((lines.size, lines.size))
    cost = math.inf
    for _ in range(ROUNDS):
        pressure = _pressure(at, readings, lines, reflex)
        band = np.abs(_depth_inside(at, lines)).min(axis=1) < BAND_MM
        if pressure is None or band.sum() <= lines.size:
            return None
        near, over = at[band], readings[band] / pressure[band]
        sigma = np.hypot(GAIN * np.clip(over, 0.0, 1.0), FLOOR)
        for _ in range(STEPS):
            rest = (over - _response(near, table, lines, reflex)) / sigma
            trust = 1 / np.maximum(1.0, np.abs(rest) / FARTHEST)
            slopes = _slopes(near, table, lines, reflex) / sigma[:, None]
            information = slopes.T @ (slopes * trust[:, None])
            damped = information + np.diag(np.tile(DAMPING, len(lines)))
            step = np.linalg.solve(damped, slopes.T @ (trust * rest)).reshape(lines.shape)
            lines = lines + np.clip(step, np.negative(MOST_CHANGE), MOST_CHANGE)
        rest = np.abs((over - _response(near, table, lines, reflex)) / sigma)
        linear = FARTHEST * (2 * rest - FARTHEST)
        cost = float(np.where(rest <= FARTHEST, rest**2, linear).mean())
    return cost, lines, information


def _pressure(at: Array, readings: Array, lines: Array, reflex: bool) -> Array | None:
    """Return the reading of each tactel if the face reached everywhere; None if unknown."""
    inside = _combine_edges(_depth_inside(at, lines), reflex)
    well = (inside > INNER_MM) & (readings > 0)
    if well.sum() < LEAST_TACTELS:
        return None
    x, y = at.T / SCALE_MM
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    level = readings[well].max()
    weights = np.exp(-inside[well] / SCALE_MM) * np.minimum(1.0, readings[well] / (0.1 * level))
    a = terms[well] * weights[:, None]
    b = np.log(np.maximum(readings[well], 1e-3 * level)) * weights
    # the ridge bounds curvatures where tactels are few
    ridge = np.diag([1e-6, 1e-3, 1e-3, 1.0, 1.0, 1.0]) * GAIN * float((weights**2).sum())
    found = np.linalg.solve(a.T @ a + ridge, a.T @ b)
    return np.asarray(np.exp(np.clip(terms @ found, math.log(level) - 5, math.log(level) + 2)))


def _depth_inside(at: Array, lines: Array) -> Array:
    """Return how far points (n, 2) lie inside each edge, (n, k)."""
    normals = np.stack([np.cos(lines[:, 0]), np.sin(lines[:, 0])])
    return np.asarray(at @ normals - lines[:, 1])


def _combine_edges(values: Array, reflex: bool) -> Array:
    """Return the smallest value of a point's edges; the largest for a reflex corner."""
    return np.asarray(values.max(axis=1) if reflex else values.min(axis=1))


def _response(at: Array, table: Array, lines: Array, reflex: bool) -> Array:
    each = response_at(table, _depth_inside(at, lines))
    return np.asarray(1 - (1 - each).prod(axis=1) if reflex else each.prod(axis=1))


def _slopes(at: Array, table: Array, lines: Array, reflex: bool) -> Array:
    """Return derivatives (n, 2 k) by angle and offset of each edge."""
    slopes = np.empty((len(at), lines.size))
    turn = SLOPE_MM / max(1.0, float(np.abs(at).max()) / 2)
    for k in range(len(lines)):
        for m, step in ((0, turn), (1, SLOPE_MM)):
            ahead, back = lines.copy(), lines.copy()
            ahead[k, m] += step
            back[k, m] -= step
            difference = _response(at, table, ahead, reflex) - _response(at, table, back, reflex)
            slopes[:, 2 * k + m] = difference / (2 * step)
    return slopes


def _edge_on_line(edge: Edge, line: Array, covariance: Array) -> Edge:
    """Return an edge on a line near it, its ends the places nearest to those it had."""
    angle, offset = math.remainder(float(line[0]), math.tau), float(line[1])
    moved = replace(edge, angle_rad=angle, offset_mm=offset, covariance=covariance)
    ends = (edge.start_mm, edge.end_mm)
    start, end = (at - float(moved.inside_mm(at)) * moved.normal for at in ends)
    return replace(moved, start_mm=start, end_mm=end)
