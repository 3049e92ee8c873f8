"""Numbers that decide how contacts are solved, one frozen value a model.

Shares are of 1; lengths in mm, angles in rad, unless a field says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ContactModelSettings:
    """What holds for every model."""

    auto_error: float = 0.06
    """The error that "auto" holds: below what the models leave out, 0.08 ... 0.14."""
    steepest_rad: float = 0.35  #: tilts beyond are not small


@dataclass(frozen=True, slots=True)
class FootprintSettings:
    """The model that asks only what is touched."""

    depth: float = 0.25  #: of the overlay's height, down to which the surface counts as touched


@dataclass(frozen=True, slots=True)
class TabSettings:
    """Separate tabs."""

    skin: float = 0.75  #: stiffness of the column behind the skin: the skin's over the column's
    tolerance: float = 1e-6  #: of the force
    finer: tuple[int, ...] = (61, 217, 817)  #: points on a tip, for thin strokes
    by_chance: int = 2  #: points of a tip that may meet a stroke by chance
    on_step: float = 0.5  #: of the tabs, at most, that may stand on a step
    corner_tabs: int = 4  #: fewer tabs are on a corner, which is sharp for any pattern
    hopeless_rad: float = 10.0
    """Turn of the plate under the whole moment, beyond which a pose of rest is looked for first."""
    margin: float = 0.1  #: of the foreseen depth, further down which points are still computed
    crushed: float = 1.4  #: power by which partial cover stiffens more at the usual strains
    sampled: int = 8  #: every so many points of a tip one foresees the pose


@dataclass(frozen=True, slots=True)
class NeoHookeSettings:
    """The law of a rubber column."""

    least_stretch: float = 1e-9  #: below, only rounding goes


@dataclass(frozen=True, slots=True)
class PlateSettings:
    """A plate at rest."""

    far_turned_rad: float = 0.2  #: beyond, the message says that the plate tips
    slack: float = 1e-12  #: of the half width, by which a centre of pressure may miss the hull


@dataclass(frozen=True, slots=True)
class PlateNewtonSettings:
    """Newton's method for the pose of the plate."""

    most_steps: int = 100
    singular: float = 1e-14  #: eigenvalue of the scaled system, of the largest
    pivot: float = 1e-6  #: of the scaled system, below which its eigenvalues are asked
    near_limit: float = 0.95  #: share of the way to a law's limit that one step may go
    whole_slope: float = 0.5  #: of the first slope that a whole step may leave
    searched_slope: float = 0.1  #: the same of a step that had to be searched
    searches: int = 200  #: lengths tried for one step


@dataclass(frozen=True, slots=True)
class LayerSettings:
    """A pad as an elastic layer: what its small strains allow."""

    deepest: float = 0.5
    """Mean indentation, of the pad's height, beyond which strains are not small."""
    thinnest: float = 1.5
    """Points of a cell that meet a stroke, on the mean, below which that is chance."""
    few: int = 2  #: cells on a step, from which on `thinnest` is asked; one may be a sharp corner
    turned: float = 0.05  #: of the indentation: what a turn may change across a cell
    least: float = 2e-3  #: of a cell: indentations below are not resolved
    passes: int = 25  #: looks at the surface, each with the plate of the last
    farthest_rad: float = 0.05  #: turn of the plate between two looks at the surface
    held_rad: float = 1e-4  #: the same for the last, where the plate was held


@dataclass(frozen=True, slots=True)
class LayerPatchSettings:
    """How the surface under a layer is looked at."""

    coarse: int = 4  #: points per cell of the first look
    samples: tuple[int, ...] = (16, 64, 256)  #: points per cell of the second, to choose from
    level_mm: float = 1e-9  #: heights that differ less are level
    search_step_mm: float = 0.01  #: along the lines that look for what the first look missed
    search_lines: int = 16  #: across the matrix, each way


@dataclass(frozen=True, slots=True)
class LayerLevelSettings:
    """Levels of a cell that stands on a step."""

    count: int = 8  #: levels at most; one where all that counts is flat
    level: float = 1e-12  #: mm, or of the greatest depth; depths that differ less are one
    least: float = 1e-3  #: share of a bell below which a cell meets nothing


@dataclass(frozen=True, slots=True)
class LayerInfluenceSettings:
    """The periodic domain of a layer."""

    rim: float = 12.0  #: free rim of the domain, both sides together, pad heights
    largest_domain: int = 4096  #: cells along one side


@dataclass(frozen=True, slots=True)
class LayerSystemSettings:
    """Linear systems of a layer by conjugate gradients."""

    most_products: int = 2000  #: of the influence with pressures
    singular: float = 1e-13  #: eigenvalue of the plate's scaled system, of the largest


@dataclass(frozen=True, slots=True)
class ActiveSetSettings:
    """Which cells of a layer bear, by an active set."""

    most_steps: int = 40
    tolerance: float = 1e-5  #: share of the force that may stand on the wrong side of q >= 0
    fine: float = 1e-5  #: residual of the last steps, of the indentation
    rough: float = 1e-3  #: the same of the first
    forcing: float = 0.01  #: residual of a step, of the share that was wrong before it


@dataclass(frozen=True, slots=True)
class DescentSettings:
    """The same by descent, where the active set does not settle."""

    most_poses: int = 50
    most_gradients: int = 5000
    halvings: int = 20  #: of one step of the plate
    tolerance: float = 1e-8  #: of the force, for the plate; of the depth, for the levels
    hessian: float = 1e-4  #: residual of the columns of the plate's matrix
    proportion: float = 1.0  #: of chopped to free gradient; 1 is the usual choice
    step: float = 1.9  #: over the largest eigenvalue; below 2


@dataclass(frozen=True, slots=True)
class ElementSettings:
    """Finite elements of a pad."""

    kept: int = 2  #: condensed pads
    rough: float = 0.25
    """Of the deepest point: strokes between the nodes that rise less are let pass."""
    growth: float = 1.5  #: from element to element of the margin
    beside: float = 0.15  #: of an element: from a wall to the lines next to it
    near: float = 0.1  #: of an element: no two lines as near as that, but walls and tactels
    tiny: float = 1e-6  #: of an element: the same place
    finer: float = 1.6  #: elements get thinner towards the top, by this power
    compressible: float = 1e-7  #: 1 - 2 nu counts as at least this; bulk over shear modulus 1e7


@dataclass(frozen=True, slots=True)
class ElementSightSettings:
    """What the nodes of elements see of a surface."""

    step_mm: float = 0.01
    """Between the points of a line, the thinnest stroke that a face can carry."""
    points: int = 4000  #: of a line, at most
    lines: int = 70  #: each way, at most
    covered: float = 0.25
    """Of the place of a node that bears alone: less is not the node's to bear."""


@dataclass(frozen=True, slots=True)
class UnilateralSettings:
    """Which nodes of elements bear."""

    steps: int = 60  #: of the active set before nodes are exchanged one by one
    floor: float = 1e-11  #: of the largest displacement or stiffness: rounding
    firm: float = 1e4  #: weight of an equation of equilibrium against the compliance
    loose: float = 1e-6  #: of the largest force or gap: what one by one must reach


@dataclass(frozen=True, slots=True)
class GelSettings:
    """Imprints in a gel."""

    fine: int = 4  #: places along a pixel at which the surface is asked
    tolerance: float = 1e-4  #: of the deepest place: by which the membrane may still move
    most: int = 2000  #: iterations of the membrane; each takes off 1 / (1 + 4 way^2) of its error


@dataclass(frozen=True, slots=True)
class DeblurSettings:
    """Taking the blur of a layer out of an image."""

    least: float = 0.01  #: share of a wave at the tactels' Nyquist frequency that must arrive
    cells: int = 4  #: of the layer, per tactel: finer than the blur


CONTACT = ContactModelSettings()
FOOTPRINT = FootprintSettings()
TABS = TabSettings()
NEO_HOOKE = NeoHookeSettings()
PLATE = PlateSettings()
PLATE_NEWTON = PlateNewtonSettings()
LAYER = LayerSettings()
LAYER_PATCH = LayerPatchSettings()
LAYER_LEVELS = LayerLevelSettings()
LAYER_INFLUENCE = LayerInfluenceSettings()
LAYER_SYSTEM = LayerSystemSettings()
ACTIVE_SET = ActiveSetSettings()
DESCENT = DescentSettings()
ELEMENTS = ElementSettings()
ELEMENT_SIGHT = ElementSightSettings()
UNILATERAL = UnilateralSettings()
GEL = GelSettings()
DEBLUR = DeblurSettings()
