"""A registered object as a small picture: SVG, faces by their distance, symbols as dots.

Seen from where the page looks at a new object. mm; the picture takes the room that it is given.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import RegisteredFace, RegisteredObject
from recognizer.bench.face_mesh import drawn_faces, face_sheets, stand_poses

Array = NDArray[np.float64]

FROM = np.array([0.55, -1.0, 0.6])  #: where it is looked at from, object frame
SUN = np.array([0.25, -0.65, 1.0])
DARK, LIGHT = 52.0, 84.0  #: lightness (%) of faces in the shade and in the sun
DOT = 0.42  #: of a pitch, diameter of a symbol's dot


def object_svg(held: RegisteredObject) -> str:
    """Return the picture of an object."""
    look = FROM / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], look)
    right /= np.linalg.norm(right)
    axes = np.stack([right, -np.cross(look, right), look], axis=1)  # x right, y down, z near
    seen = [
        (float(depth), text, corners)
        for number in drawn_faces(held)
        for depth, text, corners in _drawings(held, held.faces[number], number, axes)
    ]
    corners = np.concatenate([np.zeros((1, 2)), *(each for _, _, each in seen)])[1:]
    low, high = (
        (corners.min(axis=0), corners.max(axis=0)) if len(corners) else (np.zeros(2), np.ones(2))
    )
    x, y = low - 1.0
    w, h = high - low + 2.0
    body = "".join(text for _, text, _ in sorted(seen, key=lambda one: one[0]))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x:.1f} {y:.1f} {w:.1f} {h:.1f}" '
        f'stroke-linejoin="round" stroke-linecap="round">{body}</svg>'
    )


def _drawings(
    held: RegisteredObject, face: RegisteredFace, number: int, axes: Array
) -> Iterator[tuple[float, str, Array]]:
    """Yield depth, drawing and corners of the sheets of a face that are seen, then its symbols."""
    nearest = -np.inf
    for sheet in face_sheets(face):
        normal = np.cross(sheet[0][1] - sheet[0][0], sheet[0][2] - sheet[0][1])
        if face.round is None:
            normal = face.T_object_face[:3, 2]
        normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        if normal @ axes[:, 2] < 1e-6:
            continue
        shade = DARK + (LIGHT - DARK) * max(0.0, float(normal @ SUN) / float(np.linalg.norm(SUN)))
        loops = [loop @ axes for loop in sheet]
        path = "".join(f"M{_path(loop[:, :2])}z" for loop in loops)
        fill = f"hsl(210 16% {shade:.0f}%)"
        edge = fill if face.round is not None else "hsl(210 14% 38%)"
        depth = float(loops[0][:, 2].mean())
        nearest = max(nearest, depth)
        drawing = f'<path d="{path}" fill="{fill}" stroke="{edge}" stroke-width=".5"/>'
        yield depth, drawing, loops[0][:, :2]
    poses = stand_poses(face, held.layout.faces[number].centres_mm)
    if not len(poses) or nearest == -np.inf:
        return
    towards = poses[:, :3, 2] @ axes[:, 2] > 0.05
    dots = (poses[towards, :3, 3] @ axes)[:, :2]
    if len(dots):
        path = "".join(f"M{u:.1f} {v:.1f}h0" for u, v in dots.tolist())
        size = DOT * held.style.pitch_mm
        yield (
            nearest + 1e-3,
            (f'<path d="{path}" stroke="hsl(210 22% 40%)" stroke-width="{size:.1f}"/>'),
            dots,
        )


def _path(points: Array) -> str:
    return "L".join(f"{u:.1f} {v:.1f}" for u, v in points.tolist())
