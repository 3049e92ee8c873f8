"""The mosaic: touches, where each of them stands and how sure that is, and what they show.

Its frame is that of the face as soon as one touch was decoded, until then that of the arm's
plane. Thesis 4.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.canvas import Canvas, CanvasEntry, empty_canvas
from recognizer.scan.mosaic.errors import MosaicError
from recognizer.scan.mosaic.graph import Constraint
from recognizer.scan.mosaic.image import GlobalImage, image_of
from recognizer.scan.mosaic.patch import TouchPatch
from recognizer.scan.mosaic.settings import GRAPH, ImageSearchSettings
from recognizer.scan.mosaic.touch import PlacedTouch

Array = NDArray[np.float64]

ALONE = "no neighbour"
PARTLY = "in one direction only"


@dataclass(frozen=True, slots=True)
class MosaicSettings:
    """How touches are tied to each other."""

    search: ImageSearchSettings = field(default_factory=ImageSearchSettings)
    period_mm: float = 7.0  #: pitch of symbols, after which the surface looks alike; inf: none
    partners: int = 4  #: neighbours that a touch is registered with
    partners_decoded: int = 2  #: the same if it was decoded: they only check it
    overlap: float = 0.3  #: least share of the matrix that partners have in common
    loose_tactels: float = 0.5  #: by which beliefs are widened while images are compared
    inflation: float = 1.5  #: of pairs' covariance: pairs of one touch share its noise; measured


@dataclass(frozen=True, slots=True, eq=False)
class Mosaic:
    """A value; `grow.added` returns the next one."""

    sensor: SensorType
    settings: MosaicSettings
    touches: tuple[PlacedTouch, ...]
    patches: tuple[TouchPatch, ...]
    poses: Array  #: (n, 3) T_plane_touch, mm and rad
    covariances: Array  #: (n, 3, 3) of them; not smaller than they are until `grow.settled`
    reasons: tuple[str, ...]  #: "" where decoded or registered, otherwise why not
    gains: Array  #: (n,) readings times this are alike
    arm: Array  #: (3,) T_plane_arm
    arm_covariance: Array  #: (3, 3); zero where the arm's plane is the frame
    constraints: tuple[Constraint, ...]
    weights: Array  #: (m,) of the constraints
    chi2: Array  #: (m,)
    laid: tuple[CanvasEntry | None, ...]  #: how each touch lies on the canvas
    canvas: Canvas

    def __len__(self) -> int:
        return len(self.touches)

    @property
    def on_face(self) -> bool:
        """Whether the frame is that of the face; otherwise that of the arm's plane."""
        return any(touch.decoded is not None for touch in self.touches)

    @property
    def image(self) -> GlobalImage:
        """The global tactile image."""
        return image_of(self.canvas)


@dataclass(frozen=True, slots=True, eq=False)
class Outlier:
    """A constraint that disagrees with all others and was let go."""

    constraint: Constraint
    chi2: float  #: of three numbers; 0.1 % of good ones pass 16


def no_touches(sensor: SensorType, settings: MosaicSettings | None = None) -> Mosaic:
    """Return the mosaic of nothing, to grow from.

    Raises
    ------
    MosaicError
        Rows that stand farther apart than columns.
    """
    if sensor.row_pitch_mm:
        raise MosaicError(
            f"rows are {sensor.row_pitch_mm:g} mm apart, columns {sensor.pitch_mm:g} mm",
            fix="read single touches (Reader), or scans by poses; mosaics need one pitch",
        )
    return Mosaic(
        sensor=sensor,
        settings=settings or MosaicSettings(),
        touches=(),
        patches=(),
        poses=np.zeros((0, 3)),
        covariances=np.zeros((0, 3, 3)),
        reasons=(),
        gains=np.zeros(0),
        arm=np.zeros(3),
        arm_covariance=np.zeros((3, 3)),
        constraints=(),
        weights=np.zeros(0),
        chi2=np.zeros(0),
        laid=(),
        canvas=empty_canvas(sensor.pitch_mm),
    )


def outliers(mosaic: Mosaic) -> list[Outlier]:
    """Return the constraints that were let go, the worst first."""
    found = [
        Outlier(constraint, float(chi2))
        for constraint, weight, chi2 in zip(
            mosaic.constraints, mosaic.weights, mosaic.chi2, strict=True
        )
        if weight < GRAPH.outlier
    ]
    return sorted(found, key=lambda outlier: -outlier.chi2)
