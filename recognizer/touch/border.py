"""Where the face of a hypothesis ends, and how many other borders the image would fit as well.

Verified hypothesis -> share of the borders of a foreign face, 0 ... 1. A plate that lies over the
edge of a face tips and comes down on the bare face up to its very end: tactels read that face
there, and nothing a tip's width farther. Each line of the registered outline under the sensor is
shifted to and fro, and what the tactels about it read is compared with what the bare face would
give them that far; the share of shifts that fit as well as none at all is how often a border that
has nothing to do with the lattice would. Only tactels are asked which the plate surely presses if
there is a face: one that a tipped plate does not load says nothing of a border. Where no such
tactel lies near a line, every shift fits as well and the share is 1.

Lattices stand in the middle of their faces (`generator.layout`), so that a face of unknown size
ends anywhere within half a pitch, and opposite borders end as far from the lattice: of lines that
run alike one counts. Sizes are round numbers more often than not, which move a border by half a
millimetre, and no line tells more than `least`. Sensor frame and face frame, mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.around import mean_of_strongest
from recognizer.touch.belief import VerifiedHypothesis
from recognizer.touch.hypothesis import labels_at
from recognizer.touch.lab import EncodedFace
from recognizer.touch.pose import face_pose
from recognizer.touch.settings import BorderSettings
from recognizer.touch.symbols.fit import Fit
from recognizer.touch.symbols.gain import Image
from recognizer.touch.symbols.template import psi

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def share_of_borders(found: VerifiedHypothesis, tip_mm: float, settings: BorderSettings) -> float:
    """Return the share of foreign borders that the image fits as well as the registered one.

    Parameters
    ----------
    tip_mm
        Diameter of a tactel's tip.
    """
    face = found.embossed.face(found.hypothesis.face)
    if face.round is not None or tip_mm <= 0.0:
        return 1.0
    pressed, top, bare = _free_tactels(found, settings)
    points = points_on_face(found, face)
    readings = psi(found.image.forces / np.maximum(top, 1e-300))
    pitch, unit = found.embossed.style.pitch_mm, max(settings.noise, found.fit.noise)
    shares: list[tuple[float, float]] = []
    for inside, away, direction in _lines(face, points, settings):
        asked = pressed & away
        if asked.sum() < settings.few:
            continue
        expected = bare[asked] / np.maximum(top[asked], 1e-300)
        share = _fitting_share(
            inside[asked], readings[asked], expected, tip_mm, pitch, unit, settings
        )
        shares.append((direction, max(share, settings.least)))
    return _joint_share(shares, settings.alike_rad)


def surely_pressed(image: Image, gain: Array, share: float, settings: BorderSettings) -> Flags:
    """Return which tactels (n,) would plainly read a symbol, if there were one under them.

    Parameters
    ----------
    gain
        (4,) of the plate.
    share
        Of the strongest readings, that they would read at least.
    """
    depth = image.plane @ gain[1:]
    force = math.exp(float(gain[0])) * image.pressing.force(depth)
    return _plain(image, force, share, settings)


def _plain(image: Image, force: Array, share: float, settings: BorderSettings) -> Flags:
    strongest = mean_of_strongest(image.forces * image.trust, settings.strongest)
    least = max(share * strongest, settings.sigmas * image.noise)
    return np.asarray((image.trust > 0) & (force > least))


def points_on_lattice(image: Image, fit: Fit) -> Array:
    """Return the tactels (n, 2) in the lattice frame of a fit."""
    c, s = math.cos(fit.theta_rad), math.sin(fit.theta_rad)
    x, y = image.points_mm.T * (1.0 + float(fit.nuisance[3]))
    return np.stack([fit.x_mm + c * x - s * y, fit.y_mm + s * x + c * y], axis=-1)


def _free_tactels(
    found: VerifiedHypothesis, settings: BorderSettings
) -> tuple[Flags, Array, Array]:
    """Return which tactels would feel the bare face alone; forces (n,) on symbols and on it."""
    image, fit, template = found.image, found.fit, found.template
    depth, scale = image.plane @ fit.gain[1:], math.exp(float(fit.gain[0]))
    top = scale * image.pressing.force(depth)
    bare = scale * image.pressing.force(depth - image.pressing.symbol)
    at = points_on_lattice(image, fit)
    cells = np.floor(at / template.pitch_mm).astype(np.int64)
    labels = labels_at(found.embossed, found.hypothesis, cells)
    felt = template.at(at - (cells + 0.5) * template.pitch_mm)[..., 0]
    held = labels < template.order
    on_symbol = held & (felt[np.arange(len(at)), labels * held] > settings.bare)
    return ~on_symbol & _plain(image, bare, settings.pressed, settings), top, bare


def points_on_face(found: VerifiedHypothesis, face: EncodedFace) -> Array:
    """Return the tactels (n, 2) in the face frame, in lengths as they were designed."""
    T = face_pose(found.embossed, face, found.hypothesis, found.fit)
    points = found.image.points_mm * (1.0 + float(found.fit.nuisance[3]))
    return np.asarray(points @ T[:2, :2].T + T[:2, 3])


def _lines(
    face: EncodedFace, points: Array, settings: BorderSettings
) -> Iterator[tuple[Array, Flags, float]]:
    """Yield of each line how far inside points lie (n,), which are its own, its direction."""
    starts = np.concatenate(face.polygon_mm)
    ends = np.concatenate([np.roll(loop, -1, axis=0) for loop in face.polygon_mm])
    length = np.linalg.norm(ends - starts, axis=1)
    along = (ends - starts) / length[:, None]
    rest = points - starts[:, None]
    t = (rest * along[:, None]).sum(axis=2)
    inside = (
        along[:, :1] * rest[..., 1] - along[:, 1:] * rest[..., 0]
    )  # outlines run around the left
    beyond = np.maximum(np.maximum(-t, t - length[:, None]), 0.0)
    away = np.hypot(inside, beyond)
    ordered = np.sort(away, axis=0)
    for n in range(len(starts)):
        own = (away[n] <= ordered[0]) & (ordered[min(1, len(ordered) - 1)] > settings.apart_mm)
        own &= (t[n] > settings.ends_mm) & (t[n] < length[n] - settings.ends_mm)
        own &= np.abs(inside[n]) < settings.reach_mm
        yield inside[n], own, math.atan2(along[n, 1], along[n, 0])


def _fitting_share(
    inside: Array, readings: Array, bare: Array, tip_mm: float, pitch: float, unit: float,
    settings: BorderSettings,
) -> float:  # fmt: skip
    """Return the share of half a pitch by which a border may be shifted and fit as well.

    Parameters
    ----------
    inside, readings, bare
        (n,) mm from the line, psi of what is read, and what the bare face gives, of a symbol's.
    """
    noise, step = settings.quiet, settings.step_mm
    count = max(1, round(pitch / 2 / step))
    shifts = step * np.arange(-count, count + 1)
    share = tip_share((inside + np.append(shifts, shifts[-1] + step)[:, None]) / (tip_mm / 2))
    factors = np.exp(settings.gain * np.linspace(-1.5, 1.5, settings.gains))
    expected = psi(
        np.minimum(bare * factors[:, None], 1.0)[:, None] * share
    )  # (gains, shifts + 1, n)
    slope, expected = np.diff(expected, axis=1) / step, expected[:, :-1]
    width = unit * np.sqrt(noise**2 + expected**2 + slope**2)
    away = (readings - expected) / width
    each = -np.minimum(0.5 * away**2, settings.most) - np.log(width)
    known = 0.5 * (np.log(factors) / settings.gain) ** 2
    likelihood = (each.sum(axis=2) - known[:, None]).max(axis=0)
    as_well = likelihood >= likelihood[count] - settings.slack
    return min(1.0, float(as_well.sum()) * step / (pitch / 2))


def tip_share(inside: Array) -> Array:
    """Return the share of a round tip on one side of a line that its centre lies radii inside."""
    x = np.clip(inside, -1.0, 1.0)
    return np.asarray(0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / math.pi)


def _joint_share(shares: list[tuple[float, float]], alike_rad: float) -> float:
    """Return the product of shares, of lines that run alike the least one."""
    total, known = 1.0, list[float]()
    for direction, share in sorted(shares, key=lambda one: one[1]):
        if all(abs(math.remainder(direction - other, math.pi)) > alike_rad for other in known):
            total *= share
            known.append(direction)
    return total
