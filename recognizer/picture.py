"""A recognition as a picture: the touch with its symbols, the window on the array, the object.

Touch: sensor frame, with the lattice that explains it best. Window: rows run downwards and columns
to the right, as the array is printed; beyond the last one the numbers of the torus start again.
Object: its wireframe with the probe on it, object frame. Thesis figures 6.17 to 6.19.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet
from generator.database.read import read_object
from generator.database.registered import Polyhedron
from generator.database.transaction import read_transaction
from probe.plot.frame import HEAT, in_mm, page
from probe.plot.touch import MARK
from probe.surface.body import triangulate
from recognizer.touch.hypothesis import Hypothesis, labels_of
from recognizer.touch.lab import EmbossedArray
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

WIDTH, HEIGHT = 1500, 520  #: px
CLEARLY = 3.0  #: nats by which another symbol is likelier than the registered one
MATCH = "#5fd0ff"  #: outline of registered symbols that the touch shows
MISMATCH = "#ff5a5a"  #: of registered ones that look otherwise, or are worn
ACROSS = 240  #: points of the outlines, each way
AROUND = 8  #: cells of the window around the one under the sensor's centre
FREE, OTHERS, OBJECT, FACE = "#ffffff", "#e4e4e4", "#cfe3f7", "#f7d9a8"
VIEW_DEG = (35.0, 32.0)  #: from where the touched face is seen, off its normal
AXES = (("x", "tab:red"), ("y", "tab:green"), ("z", "tab:blue"))
MANY = 40  #: faces beyond which they are not named
FACING = 0.2  #: least cosine to the eye of a face that is named


@dataclass(frozen=True, slots=True, eq=False)
class WinningLattice:
    """The lattice that explains a touch best, whether the touch is answered or not."""

    encoding: EmbossedArray
    place: Hypothesis
    x_mm: float  #: a sensor point s lies at R(theta) s + (x, y) on the lattice
    y_mm: float
    theta_rad: float
    cells: Ints  #: (m, 2) column and upward row of the lattice
    registered: Ints  #: (m,) symbol that the face holds there; -1: none
    matched: NDArray[np.bool_]  #: (m,) whether no other symbol is clearly likelier there

    def on_sensor(self, points_mm: Array) -> Array:
        """Return points (..., 2) of the lattice in the sensor frame, mm."""
        return np.asarray((points_mm - (self.x_mm, self.y_mm)) @ _turn(self.theta_rad))

    def on_array(self, points_mm: Array) -> Array:
        """Return sensor points (n, 2) as columns and rows of the array, in cells."""
        cells = points_mm @ _turn(self.theta_rad).T + (self.x_mm, self.y_mm)
        cells = cells / self.encoding.style.pitch_mm
        return np.stack([self.place.column + cells[:, 0], self.place.row + 1 - cells[:, 1]], axis=1)


def touch_picture(
    reader: Reader,
    signal: Signal,
    found: Recognition,
    path: Path,
    *,
    T_robot_object: Array | None = None,
) -> None:
    """Draw a touch with its symbols, the window on the array, and the object with the probe on it.

    An answer without an object gets the first panel. `T_robot_object` (4, 4), mm, is written where
    it is known; `path` is a PNG.
    """
    won = winning_lattice(reader, signal)
    with page(path, WIDTH, HEIGHT) as figure:
        figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 0.95))
        figure.suptitle(_title(found, T_robot_object))
        touched, window = (figure.add_subplot(1, 3, k) for k in (1, 2))
        solid = figure.add_subplot(1, 3, 3, projection="3d")
        draw_touch(touched, reader.sensor, signal, won)
        if not found or won is None:
            _say_why(window, found)
            solid.set_axis_off()
            return
        _draw_window(window, reader.sensor, won)
        _draw_object(solid, won.encoding, reader.sensor, found)


def winning_lattice(reader: Reader, signal: Signal) -> WinningLattice | None:
    """Return the best reading of a touch; None where no symbol is seen."""
    best = read_touch(reader, signal).best
    if best is None:
        return None
    encoding, place, fit = best.embossed, best.hypothesis, best.fit
    shown = labels_of(encoding, place, fit.cells)
    return WinningLattice(
        encoding, place, fit.x_mm, fit.y_mm, fit.theta_rad, fit.cells,
        registered=np.where(shown == encoding.array.order, -1, shown),
        matched=fit.scores[np.arange(len(shown)), shown] > -CLEARLY,
    )  # fmt: skip


def _say_why(axes: Axes, found: Recognition) -> None:
    axes.set_axis_off()
    lines = [found.reason]
    if found.margin is not None:
        lines.append(f"margin {found.margin / math.log(2):.1f} bits")
    if found.runner_up is not None:
        lines.append(f"also possible: {found.runner_up.object}, face {found.runner_up.face}")
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)


def _title(found: Recognition, T_robot_object: Array | None) -> str:
    if not found or found.T_face_probe is None:
        return f"touch {found.seq}: not recognised, {found.reason}"
    T = found.T_face_probe
    turn = math.degrees(math.atan2(T[1, 0], T[0, 0]))
    text = (
        f"touch {found.seq}: {found.object}, face {found.face}, x {T[0, 3]:.2f} mm, "
        f"y {T[1, 3]:.2f} mm, turned {turn:.1f} degrees; array {found.index}"
    )
    if T_robot_object is not None:
        at = ", ".join(f"{value:.1f}" for value in T_robot_object[:3, 3])
        text += f"; in the robot's base ({at}) mm"
    return text


def draw_touch(axes: Axes, sensor: SensorType, signal: Signal, won: WinningLattice | None) -> None:
    """Draw readings, lattice, and outlines of the symbols; untrusted tactels are crossed."""
    half_x, half_y = sensor.half_mm
    box = (-half_x, half_x, -half_y, half_y)
    heat = Normalize(0.0, max(float(signal.forces.max()), 1e-9))
    drawn = axes.imshow(signal.forces, cmap=HEAT, norm=heat, extent=box)
    unit = "force (N)" if signal.newtons else "reading over the background (counts)"
    axes.figure.colorbar(drawn, ax=axes, label=unit, shrink=0.75)
    bad = sensor.centres_mm()[signal.trust <= 0]
    axes.plot(bad[:, 0], bad[:, 1], "x", color="white", markersize=4)
    in_mm(axes, "touch and fitted symbols")
    if won is not None:
        pitch = won.encoding.style.pitch_mm
        square = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])
        cells = [won.on_sensor((cell + square) * pitch) for cell in won.cells]
        axes.add_collection(LineCollection(cells, colors="white", linewidths=0.4, alpha=0.5))
        _outlines(axes, sensor, won, won.matched, MATCH)
        _outlines(axes, sensor, won, ~won.matched, MISMATCH)
    axes.set_xlim(-half_x, half_x)
    axes.set_ylim(-half_y, half_y)


def _turn(theta_rad: float) -> Array:
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    return np.array([[c, -s], [s, c]])


def _strokes_mm(alphabet: Alphabet, label: int, pitch_mm: float) -> Array:
    """Return the strokes (n, 2, 2) of a symbol about its centre, mm."""
    return np.array(alphabet.glyphs[label].strokes, np.float64) * (alphabet.reach * pitch_mm)


def _outlines(
    axes: Axes, sensor: SensorType, won: WinningLattice, which: NDArray[np.bool_], colour: str
) -> None:
    """Draw how far the strokes reach of those symbols that the face holds."""
    half_x, half_y = sensor.half_mm
    x, y = np.linspace(-half_x, half_x, ACROSS), np.linspace(-half_y, half_y, ACROSS)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    away = np.full(points.shape[:2], np.inf)
    pitch = won.encoding.style.pitch_mm
    for cell, label in zip(won.cells[which], won.registered[which], strict=True):
        if label >= 0:
            strokes = _strokes_mm(won.encoding.alphabet, int(label), pitch) + (cell + 0.5) * pitch
            for start, end in won.on_sensor(strokes):
                along = end - start
                t = ((points - start) @ along / max(float(along @ along), 1e-12)).clip(0, 1)
                offset = points - start - t[..., None] * along
                away = np.minimum(away, np.linalg.norm(offset, axis=-1))
    edge = won.encoding.style.stroke_mm / 2
    if away.min() < edge < away.max():
        axes.contour(x, y, np.minimum(away, 2 * edge), [edge], colors=colour, linewidths=1.2)


def _draw_window(axes: Axes, sensor: SensorType, won: WinningLattice) -> None:
    encoding, place = won.encoding, won.place
    array, pitch = encoding.array, encoding.style.pitch_mm
    middle_row = place.row - math.floor(won.y_mm / pitch)
    middle_column = place.column + math.floor(won.x_mm / pitch)
    rows, columns = np.meshgrid(
        np.arange(middle_row - AROUND, middle_row + AROUND + 1),
        np.arange(middle_column - AROUND, middle_column + AROUND + 1),
        indexing="ij",
    )
    owners, labels = encoding.at(rows % array.rows, columns % array.columns)
    objects = np.append(encoding.faces[:, 0], -1)[owners]
    mine = objects == encoding.faces[place.face, 0]
    kind = np.select([owners == place.face, mine, owners >= 0], [3, 2, 1], 0)
    box = (columns[0, 0], columns[0, -1] + 1, rows[-1, 0] + 1, rows[0, 0])
    colours = ListedColormap([FREE, OTHERS, OBJECT, FACE])
    axes.imshow(kind, cmap=colours, vmin=-0.5, vmax=3.5, extent=box)
    lines = []
    for row, column, label in zip(rows.flat, columns.flat, labels.flat, strict=True):
        if label >= 0:
            strokes = _strokes_mm(encoding.alphabet, int(label), 1.0) * (1, -1)
            lines += list(strokes + np.array([column + 0.5, row + 0.5]))
    axes.add_collection(LineCollection(lines, colors="#303030", linewidths=0.9))
    half_x, half_y = sensor.half_mm
    corners = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    outline = won.on_array(corners)
    axes.add_patch(Polygon(outline, fill=False, edgecolor=MARK, linewidth=1.8))
    axes.plot(*outline[3], "o", color=MARK, markersize=5)
    axes.plot(*won.on_array(np.zeros((1, 2)))[0], "+", color=MARK)
    axes.set_xticks(columns[0, ::4] + 0.5, (columns[0, ::4] % array.columns).tolist())
    axes.set_yticks(rows[::4, 0] + 0.5, (rows[::4, 0] % array.rows).tolist())
    known = ((FACE, "this face"), (OBJECT, "this object"), (OTHERS, "others"))
    patches = [Patch(facecolor=colour, edgecolor="#808080", label=name) for colour, name in known]
    axes.legend(handles=patches, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=3,
                frameon=False, fontsize=8)  # fmt: skip
    axes.set_xlabel("column")
    axes.set_ylabel("row")
    axes.set_title(f"window on the array, {array.rows} x {array.columns}")


def _draw_object(
    axes: Any,  # mplot3d has no types
    encoding: EmbossedArray,
    sensor: SensorType,
    found: Recognition,
) -> None:
    """Draw the edges, the names of the faces in front, the one touched, and the probe."""
    if found.object is None or found.T_object_probe is None:
        return
    axes.computed_zorder = False  # what is drawn later lies above
    with read_transaction(encoding.engine) as connection:
        held = read_object(connection, found.object)
    solid = held.polyhedron
    for edge in solid.edges:
        axes.plot(*solid.vertices[[edge.start, edge.end]].T, color="#404040", linewidth=0.9,
                  zorder=2)  # fmt: skip
    touched = next((f for f in held.faces if f.name == found.face), None)
    if touched is not None:
        loops = solid.faces[touched.face_id].loops
        corners = solid.vertices[np.concatenate([np.array(loop) for loop in loops])]
        _fill(axes, corners, triangulate(touched.polygon_mm), FACE, 0.4, 1)
    _draw_probe(axes, sensor, found.T_object_probe)
    eye = _look(axes, solid, found.T_object_probe)
    for face in solid.faces if len(solid.faces) <= MANY else ():
        corners = solid.vertices[list(face.loops[0])]
        middle = corners.mean(axis=0)
        normal = np.cross(corners - middle, np.roll(corners, -1, axis=0) - middle).sum(axis=0)
        if face.name != found.face and normal @ eye > FACING * np.linalg.norm(normal):
            axes.text(*middle, face.name, fontsize=8, color="#404040", ha="center", zorder=6)


def _draw_probe(axes: Any, sensor: SensorType, T: Array) -> None:
    """Draw the sensor's outline, its axes, and a dot at tactel (0, 0)."""
    x, y = sensor.half_mm
    corners = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)]) @ T[:3, :3].T + T[:3, 3]
    _fill(axes, corners, np.array([(0, 1, 2), (0, 2, 3)]), MARK, 0.45, 3)
    axes.plot(*corners[[0, 1, 2, 3, 0]].T, color=MARK, linewidth=1.2, zorder=3)
    axes.plot(*corners[3:4].T, "o", color=MARK, markersize=4, zorder=4)
    for k, (_, colour) in enumerate(AXES):
        tip = T[:3, 3] + T[:3, k] * sensor.reach_mm
        axes.plot(*np.stack([T[:3, 3], tip]).T, color=colour, linewidth=1.6, zorder=5)


def _fill(
    axes: Any, corners: Array, triangles: NDArray[np.int64], colour: str, alpha: float, zorder: int
) -> None:
    axes.plot_trisurf(*corners.T[:2], triangles, corners.T[2], color=colour, alpha=alpha,
                      shade=False, linewidth=0, antialiased=False, zorder=zorder)  # fmt: skip


def _look(axes: Any, solid: Polyhedron, T_object_probe: Array) -> Array:
    """Look at the touched face off its normal, the whole object in view; returns whence, (3,)."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) * 0.6
    for k, (name, _) in enumerate(AXES):
        getattr(axes, f"set_{name}lim")(middle[k] - half, middle[k] + half)
        getattr(axes, f"set_{name}label")(f"{name} (mm)")
    axes.locator_params(nbins=4)  # more of them cover each other where an axis is foreshortened
    axes.set_box_aspect((1, 1, 1), zoom=0.85)
    x, y, z = T_object_probe[:3, 2]
    up = math.degrees(math.asin(max(-1.0, min(1.0, z))))
    azimuth = math.degrees(math.atan2(y, x)) if math.hypot(x, y) > 1e-6 else -60.0
    elevation, azimuth = up - VIEW_DEG[1] * (1 if up > 45 else -1), azimuth + VIEW_DEG[0]
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set_title("object and probe")
    e, a = math.radians(elevation), math.radians(azimuth)
    return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
