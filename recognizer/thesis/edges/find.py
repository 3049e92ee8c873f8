"""Touch or mosaic -> the edges and corners of the face in view. Thesis 4.3, appendix 3.

`classical_edges` is the thesis's way, for images of any resolution: median, Sobel, adaptive
Hough, production rules. `face_edges` goes on for a single touch: the edges are moved until they
explain the readings of the tactels themselves, which is several times as precise. Faces with
symbols are not felt themselves, only their symbols are; there, edges are those of symbols.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.edges.fit import FittedEdges, fit_edges
from recognizer.thesis.edges.hough import segments
from recognizer.thesis.edges.line import Corner, Edge, corner_between
from recognizer.thesis.edges.points import edge_points
from recognizer.thesis.edges.syntax import fuse_segments, vertices
from recognizer.thesis.filters import magnify_image, median, subtract_bias
from recognizer.thesis.settings import EDGE_RESPONSE, EdgeSearchSettings, SyntaxRules
from recognizer.touch.signal import Signal
from recognizer.touch.tactile_image import TactileImage, touch_image

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """What of a face's outline is in view."""

    edges: tuple[Edge, ...]  #: image frame, the longest first
    corners: tuple[Corner, ...]
    inside: NDArray[np.bool_]  #: (h, w) samples that lie on the face
    off: float  #: rms of what is not explained, in expected standard deviations; NaN: not fitted


def classical_edges(
    image: TactileImage, finding: EdgeSearchSettings | None = None
) -> tuple[Edge, ...]:
    """Return the edges in an image by the thesis's way, the longest first.

    Parameters
    ----------
    image
        Readings of a touch or a mosaic.
    """
    chosen = finding or EdgeSearchSettings()
    over = subtract_bias(image)
    if chosen.median:
        over = median(over)
    fine = magnify_image(over, chosen.doublings)
    return fuse_segments(segments(edge_points(fine, chosen.steep), chosen.hough), chosen.rules)


def face_edges(
    image: TactileImage, sensor: SensorType, finding: EdgeSearchSettings | None = None
) -> tuple[Edge, ...]:
    """Return the edges of a blank face that one touch feels, in the sensor frame.

    Parameters
    ----------
    image
        `filters.touch_image` of the touch.
    sensor
        The one that felt it.

    Returns
    -------
    None, one, or several; each with the covariance of its angle and offset.

    Examples
    --------
    >>> from recognizer.touch.tactile_image import touch_image
    >>> readings = np.zeros((16, 16))
    >>> readings[:, 7:] = 0.5
    >>> edge, = face_edges(touch_image(SensorType(), readings), SensorType())
    >>> bool(abs(edge.angle_rad) < 0.02 and abs(edge.offset_mm + 1.5875) < 0.2)
    True
    """
    return outline(image, sensor, finding).edges


def touch_edges(sensor: SensorType, signal: Signal) -> tuple[Edge, ...]:
    """Return the edges that a touch feels, in the sensor frame, as a reader gets its signal.

    Of a face without symbols these are the edges of the face. Of one with symbols they are lines
    along which symbols end, and seldom any: what is pressed there is no even plane.
    """
    if not signal.contact:
        return ()
    return face_edges(touch_image(sensor, signal.forces, signal.trust), sensor)


def outline(
    image: TactileImage, sensor: SensorType, finding: EdgeSearchSettings | None = None
) -> Outline:
    """Return edges and corners that one touch feels, in the sensor frame; see `face_edges`."""
    chosen = finding or EdgeSearchSettings()
    over = subtract_bias(image)
    rough = tuple(edge for edge in classical_edges(image, chosen) if _bounds(over, edge, chosen))[
        : chosen.most
    ]
    if not rough:
        return Outline((), (), over.values > 0, math.nan)
    best = _best(over, sensor, rough, chosen)
    if best is not None:
        kept = tuple(
            edge
            for edge, before in zip(best.edges, rough, strict=True)
            if _moved_mm(edge, before) <= chosen.moved_mm and _bounds(over, edge, chosen)
        )
        if len(kept) < len(rough):
            best = _best(over, sensor, kept, chosen) if kept else None
    if best is None or best.off > chosen.off:
        return Outline((), (), over.values > 0, math.nan if best is None else best.off)
    return Outline(best.edges, _corners(best, chosen.rules), best.inside, best.off)


def _best(
    image: TactileImage, sensor: SensorType, edges: tuple[Edge, ...], finding: EdgeSearchSettings
) -> FittedEdges | None:
    """Return the fit of a face inside of all edges, or of any, whichever explains more."""
    reflex = False
    if len(edges) > 1:
        ways = [
            fit_edges(
                image,
                sensor,
                edges,
                reflex=way,
                blurs_mm=EDGE_RESPONSE.blurs_mm[1:2],
                fitting=finding.fitting,
            )
            for way in (False, True)
        ]
        off = [math.inf if way is None else way.off for way in ways]
        reflex = off[1] < off[0]
    return fit_edges(image, sensor, edges, reflex=reflex, fitting=finding.fitting)


def _bounds(image: TactileImage, edge: Edge, finding: EdgeSearchSettings) -> bool:
    """Whether a face that is pressed ends here.

    Beyond other edges something is felt, too: folds of the pressure. Where the plate lifts off
    the face, hardly anything is felt on this side either.
    """
    rows, columns = np.indices(image.values.shape)
    at = image.xy_mm(rows, columns)
    inside = edge.inside_mm(at) / image.step_mm
    way = (edge.end_mm - edge.start_mm) / max(edge.length_mm, 1e-9)
    along = (at - edge.start_mm) @ way
    beside = image.defined & (along > 0) & (along < edge.length_mm)
    outer, inner = (beside & (side > 0.8) & (side < 3.0) for side in (-inside, inside))
    if not (outer.any() and inner.any()):
        return False
    felt = float(np.median(image.values[inner]))
    most = float(np.quantile(image.values[image.defined & (image.values > 0)], 0.9))
    beyond = float(np.median(image.values[outer]))
    return felt >= finding.firm * most and beyond <= finding.beyond * felt


def _moved_mm(edge: Edge, before: Edge) -> float:
    ends = np.stack([before.start_mm, before.end_mm])
    return float(np.abs(edge.inside_mm(ends)).max())


def _corners(found: FittedEdges, rules: SyntaxRules) -> tuple[Corner, ...]:
    """Return the corners with the covariance of edges that were fitted together."""
    corners = []
    for corner in vertices(found.edges, rules):
        k, m = (next(n for n, e in enumerate(found.edges) if e is edge)
                for edge in (corner.first, corner.second))  # fmt: skip
        rows = [2 * k, 2 * k + 1, 2 * m, 2 * m + 1]
        joint = corner_between(corner.first, corner.second, found.covariance[np.ix_(rows, rows)])
        corners.append(joint or corner)
    return tuple(corners)
