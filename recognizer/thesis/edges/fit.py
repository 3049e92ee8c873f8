"""Edges that are nearly right -> edges that explain what the tactels of one touch read.

The face presses as p(x, y) = exp(a quadratic form), which follows a tilted plate and an overlay
that hardens; a tactel reads p times its response to every edge near it. In turns, p is fitted
to the tactels well inside, and the edges by least squares to what is read over p beside them,
each weighted by how well its reading is known; the blur is the one that explains most.
Readings are good to a share of themselves (gains of tactels) and to a floor (noise).

Where the face goes round a corner (opening over pi), a tactel is on the face if it is inside
of one of the two edges; else it must be inside of both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.edges.line import Edge
from recognizer.thesis.edges.response import felt_at, responses
from recognizer.thesis.settings import EDGE_RESPONSE, EdgeFitSettings
from recognizer.touch.tactile_image import TactileImage

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FittedEdges:
    """Edges with what they leave unexplained."""

    edges: tuple[Edge, ...]
    covariance: Array  #: (2 k, 2 k) of angle (rad) and offset (mm) of each, in order
    blur_mm: float
    off: float  #: rms of what is not explained, in expected standard deviations
    inside: Mask  #: (rows, columns) tactels that lie on the face


def fit_edges(
    image: TactileImage,
    sensor: SensorType,
    edges: tuple[Edge, ...],
    *,
    reflex: bool = False,
    blurs_mm: Sequence[float] = EDGE_RESPONSE.blurs_mm,
    fitting: EdgeFitSettings | None = None,
) -> FittedEdges | None:
    """Fit one, two or more edges at once.

    Parameters
    ----------
    image
        One touch over its bias, a sample to each tactel.
    sensor
        The one that felt it.
    edges
        Where they are roughly: within a tactel, ten degrees.
    reflex
        Whether a tactel is on the face that is inside of any, not of all edges.
    blurs_mm
        Those that are tried, of `EdgeResponseSettings.blurs_mm`.

    Returns
    -------
    None where too few tactels lie on the face to tell.
    """
    chosen = fitting or EdgeFitSettings()
    rows, columns = np.indices(image.values.shape)
    at = image.xy_mm(rows, columns)[image.defined]
    readings = image.values[image.defined]
    tables = responses(sensor)
    lines = np.array([[edge.angle_rad, edge.offset_mm] for edge in edges])
    best: tuple[float, Array, float, Array] | None = None
    for blur in blurs_mm:
        table = tables[EDGE_RESPONSE.blurs_mm.index(blur)]
        found = _fit_with_blur(at, readings, table, lines, reflex, chosen)
        if found is not None and (best is None or found[0] < best[0]):
            best = (found[0], found[1], blur, found[2])
    if best is None:
        return None
    cost, lines, blur, information = best
    off = math.sqrt(cost)
    model = np.diag(np.tile([chosen.model_rad**2, chosen.model_mm**2], len(lines)))
    covariance = np.asarray(np.linalg.pinv(information), np.float64) * max(1.0, off) ** 2 + model
    moved = tuple(
        _edge_on_line(edge, lines[k], covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2])
        for k, edge in enumerate(edges)
    )
    inside = np.zeros(image.values.shape, np.bool_)
    inside[image.defined] = _combine_edges(_depth_inside(at, lines), reflex) > 0
    return FittedEdges(moved, covariance, blur, off, inside)


def _fit_with_blur(
    at: Array, readings: Array, table: Array, lines: Array, reflex: bool, fitting: EdgeFitSettings
) -> tuple[float, Array, Array] | None:
    """Return the mean cost, lines and information (2 k, 2 k) with one blur."""
    information = np.zeros((lines.size, lines.size))
    most = np.array(fitting.most)
    cost = math.inf
    for _ in range(fitting.rounds):
        pressure = _pressure(at, readings, lines, reflex, fitting)
        band = _band(at, lines, fitting)
        if pressure is None or band.sum() <= lines.size:
            return None
        near, over = at[band], readings[band] / pressure[band]
        sigma = np.hypot(fitting.gain * np.clip(over, 0.0, 1.0), fitting.floor)
        for _ in range(fitting.steps):
            rest = (over - _response(near, table, lines, reflex)) / sigma
            trust = 1 / np.maximum(1.0, np.abs(rest) / fitting.farthest)
            slopes = _slopes(near, table, lines, reflex, fitting) / sigma[:, None]
            information = slopes.T @ (slopes * trust[:, None])
            damped = information + np.diag(np.tile(fitting.damping, len(lines)))
            step = np.linalg.solve(damped, slopes.T @ (trust * rest)).reshape(lines.shape)
            lines = lines + np.clip(step, -most, most)
        rest = np.abs((over - _response(near, table, lines, reflex)) / sigma)
        far = fitting.farthest
        cost = float(np.where(rest <= far, rest**2, far * (2 * rest - far)).mean())
    return cost, lines, information


def _pressure(
    at: Array, readings: Array, lines: Array, reflex: bool, fitting: EdgeFitSettings
) -> Array | None:
    """Return what each tactel would read if the face reached everywhere; None if unknown."""
    inside = _combine_edges(_depth_inside(at, lines), reflex)
    well = (inside > fitting.inner_mm) & (readings > 0)
    if well.sum() < fitting.least_tactels:
        return None
    x, y = at.T / fitting.scale_mm
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    level = readings[well].max()
    weights = np.exp(-inside[well] / fitting.scale_mm) * np.minimum(
        1.0, readings[well] / (0.1 * level)
    )
    a = terms[well] * weights[:, None]
    b = np.log(np.maximum(readings[well], 1e-3 * level)) * weights
    # bends are told only where there are tactels enough, and do not run away beyond them
    ridge = np.diag([1e-6, 1e-3, 1e-3, 1.0, 1.0, 1.0]) * fitting.gain * float((weights**2).sum())
    found = np.linalg.solve(a.T @ a + ridge, a.T @ b)
    return np.asarray(np.exp(np.clip(terms @ found, math.log(level) - 5, math.log(level) + 2)))


def _depth_inside(at: Array, lines: Array) -> Array:
    """Return how far points (n, 2) lie inside each edge, (n, k)."""
    normals = np.stack([np.cos(lines[:, 0]), np.sin(lines[:, 0])])
    return np.asarray(at @ normals - lines[:, 1])


def _combine_edges(values: Array, reflex: bool) -> Array:
    """Return what holds for a face inside of all edges, or of any."""
    return np.asarray(values.max(axis=1) if reflex else values.min(axis=1))


def _response(at: Array, table: Array, lines: Array, reflex: bool) -> Array:
    each = felt_at(table, _depth_inside(at, lines))
    return np.asarray(1 - (1 - each).prod(axis=1) if reflex else each.prod(axis=1))


def _slopes(at: Array, table: Array, lines: Array, reflex: bool, fitting: EdgeFitSettings) -> Array:
    """Return derivatives (n, 2 k) by angle and offset of each edge.

    Steps are as wide as half the gap between two tabs, in which nothing changes: an edge there
    is known no better than that.
    """
    slopes = np.empty((len(at), lines.size))
    turn = fitting.slope_mm / max(1.0, float(np.abs(at).max()) / 2)
    for k in range(len(lines)):
        for m, step in ((0, turn), (1, fitting.slope_mm)):
            ahead, back = lines.copy(), lines.copy()
            ahead[k, m] += step
            back[k, m] -= step
            difference = _response(at, table, ahead, reflex) - _response(at, table, back, reflex)
            slopes[:, 2 * k + m] = difference / (2 * step)
    return slopes


def _band(at: Array, lines: Array, fitting: EdgeFitSettings) -> Mask:
    return np.asarray(np.abs(_depth_inside(at, lines)).min(axis=1) < fitting.band_mm)


def _edge_on_line(edge: Edge, line: Array, covariance: Array) -> Edge:
    """Return an edge on a line near it, its ends the places nearest to those it had."""
    moved = replace(
        edge,
        angle_rad=math.remainder(float(line[0]), math.tau),
        offset_mm=float(line[1]),
        covariance=covariance,
    )
    ends = [
        end - float(moved.inside_mm(end)) * moved.normal for end in (edge.start_mm, edge.end_mm)
    ]
    return replace(moved, start_mm=ends[0], end_mm=ends[1])
