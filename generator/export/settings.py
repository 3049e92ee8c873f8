"""How the preview of an object looks: every number that decides a pixel."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PreviewSettings:
    """View, light and labels of the preview; pixels of the finished picture (px)."""

    # preview.py
    width: int = 1200
    """Of the picture, px."""
    height: int = 700
    """Of the picture, px."""
    samples: int = 2
    """A side for each pixel: smooth edges at four times the work."""
    label_step: int = 4
    """Pixels between the places where a name may stand."""
    top: int = 84
    """Pixels above the views: title and captions."""
    bottom: int = 46
    """Pixels below the views: the scale."""
    light: tuple[float, float, float] = (-0.48, 0.56, 0.67)
    """Towards the light; screen axes: right, up, eye."""
    ambient: float = 0.42
    """Share of the light that comes from everywhere."""
    apart: float = 0.10
    """Of the object's size: how far panels are moved apart."""
    facing: float = 0.12
    """Least cosine to the eye at which a face gets its name."""
    back: float = -0.999
    """Greatest cosine to the face at which a facet is the back of its panel."""
    open: float = 0.2
    """Least cosine that a good view has on every face."""
    line_rgb: tuple[int, int, int] = (51, 65, 85)
    """Of edges."""
    paper_rgb: tuple[tuple[int, int, int], ...] = ((250, 251, 253), (224, 230, 238))
    """Top and bottom of the background."""
    block: int = 16_384
    """Triangles shaded at once: bounds the memory."""

    # labels.py
    label_half_height: float = 13.0
    """Of a name, px."""
    label_gap: float = 3.0
    """Between two names, px."""
    label_least: int = 8
    """Places of the map at which a face must be seen to get its name."""
    label_far: float = 0.7
    """What a name loses by standing as far from the middle as the face is large."""


PREVIEW = PreviewSettings()


@dataclass(frozen=True, slots=True)
class ArraySvgSettings:
    """The picture of the array with the faces laid on it."""

    full: int = 300  #: cells a side up to which the whole array is drawn
    margin: int = 3  #: cells around the faces in a cropped picture
    named: float = 1.5  #: cells: a narrower strip of a face bears no name
    cell: int = 14  #: px
    wide: int = 1600  #: px; a wider picture gets smaller cells


@dataclass(frozen=True, slots=True)
class RasterSettings:
    """Blocks in which triangles become pixels: memory and time, no pixel."""

    spans: int = 4096  #: at a time, so that they stay in the cache
    rows: int = 32  #: of the picture at a time
    triangles: int = 16_384  #: drawn at once: they stay in the cache


ARRAY_SVG = ArraySvgSettings()
RASTER = RasterSettings()
