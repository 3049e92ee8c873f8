"""Readers of the benchmark: ours, and what it is measured against. One more: `BenchmarkReader`.

A reader gets a world (`ReaderWorld`) once and the counts of one touch at a time, and returns an
`ReaderAnswer`, or None where it refuses. `score` orders its answers, the surest first.

::

    ours       this package's reader
    thesis     filters, skeletons and decoder, as the thesis has them (`recognizer.thesis`)
    template   the likeliest of many rendered places of all faces, moved to where it fits best
    network    two hidden layers for the face and two for the place, trained on the public half
    chance     any face, anywhere
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.lab import EncodedFace, open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.validation.dataset import faces_by_name
from recognizer.validation.errors import ValidationError
from recognizer.validation.touch_plan import written_surface

Array = NDArray[np.float64]

TEMPLATES = 60_000  #: rendered places of all faces, 60 MB; the best are moved
BEST, STEPS = 5, ((0.6, 0.05), (0.2, 0.02), (0.06, 0.005))  #: of these, by so many mm and rad
RASTER_MM = 0.25  #: of the heights that templates are rendered from
LAYERS, EPOCHS = (256, 128), 400  #: of the network


class ReaderAnswer(NamedTuple):
    """What a reader says of a touch."""

    name: str  #: "Object/face"
    x_mm: float  #: of the sensor's centre, face frame
    y_mm: float
    theta_rad: float
    score: float = 0.0  #: the higher, the surer
    covariance: Array | None = None  #: (3, 3) of x, y, theta


@dataclass(frozen=True, eq=False)
class ReaderWorld:
    """What a reader may know of a world before it is touched."""

    name: str
    database: str  #: of the registered parts
    sensor: SensorType
    public: dict[str, NDArray[Any]]  #: touches with truth, for training (`benchmark`)

    @cached_property
    def faces(self) -> dict[str, EncodedFace]:
        """The registered faces, by "Object/face", in order."""
        return faces_by_name(open_lab(self.database))


Read = Callable[[NDArray[np.uint16]], ReaderAnswer | None]
BenchmarkReader = Callable[[ReaderWorld], Read]
"""World -> counts (rows, columns) -> answer, or None."""


def reader_named(name: str) -> BenchmarkReader:
    """Return a reader by its name here, or as `module:function`.

    Raises ValidationError: there is none of that name.
    """
    if name in READERS:
        return READERS[name]
    module, _, function = name.partition(":")
    if (here := os.getcwd()) not in sys.path:  # where an installed command does not look
        sys.path.append(here)
    try:
        found: BenchmarkReader = getattr(import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValidationError(
            f"no reader '{name}': {error}",
            fix=f"give {', '.join(READERS)}, or module:function of one that can be imported",
            place="--reader",
        ) from error
    return found


def _answer_of(found: Recognition) -> ReaderAnswer | None:
    T = found.T_face_probe
    if not found or T is None:
        return None
    margin = math.inf if found.margin is None else found.margin
    # without a rival the margin is without end: then the bits order the answers
    score = min(margin, 1e6) + (found.bits or 0.0)
    turn = math.atan2(T[1, 0], T[0, 0])
    name = f"{found.object}/{found.face}"
    return ReaderAnswer(name, float(T[0, 3]), float(T[1, 3]), turn, score, found.covariance)


def ours(world: ReaderWorld) -> Read:
    """Return this package's reader."""
    reader = Reader(open_lab(world.database), world.sensor)
    return lambda counts: _answer_of(recognise(reader, reader.signal(counts), 0))


def thesis(world: ReaderWorld) -> Read:
    """Return the thesis's reading of one touch."""
    require("skimage", extra="benchmark", purpose="the thesis's reading")
    from recognizer.thesis.read import read_classically
    from recognizer.touch.tactile_image import touch_image

    reader = Reader(open_lab(world.database), world.sensor)

    def read(counts: NDArray[np.uint16]) -> ReaderAnswer | None:
        signal = reader.signal(counts)
        image = touch_image(world.sensor, signal.forces, signal.trust)
        return _answer_of(read_classically(reader.lab, image).recognition)

    return read


def chance(world: ReaderWorld) -> Read:
    """Return what names any face, anywhere."""
    rng = np.random.default_rng(0)
    names = list(world.faces)

    def read(_counts: NDArray[np.uint16]) -> ReaderAnswer:
        name = names[int(rng.integers(len(names)))]
        places = world.faces[name].centres_mm
        x, y = places[int(rng.integers(len(places)))].tolist()
        return ReaderAnswer(name, x, y, float(rng.uniform(-math.pi, math.pi)), float(rng.random()))

    return read


def template(world: ReaderWorld) -> Read:
    """Return what takes the nearest of `TEMPLATES` rendered places, moved to where it fits best."""
    from scipy.ndimage import gaussian_filter, map_coordinates

    rng = np.random.default_rng(0)
    sensor, names = world.sensor, list(world.faces)
    tactels = sensor.centres_mm().reshape(-1, 2)
    rasters, lows = [], []
    for face in world.faces.values():
        low, high = (np.array(end) for end in face.region.box_mm)
        axes = [np.arange(a, b, RASTER_MM) for a, b in zip(low - 5, high + 5, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        surface = written_surface(world.database, face.object, face.face).surface
        heights = surface.heights_mm(points.reshape(-1, 2)).reshape(points.shape[:2])
        blur = sensor.pitch_mm / 2 / RASTER_MM
        rasters.append(gaussian_filter(np.clip(heights, -1.0, None), blur).astype(np.float32))
        lows.append(low - 5)

    def render(face: int, places: Array) -> NDArray[np.float32]:
        """Return images (n, tactels) of unit length at places (n, 3) of a face."""
        c, s = np.cos(places[:, 2:]), np.sin(places[:, 2:])
        x, y = tactels.T
        at = np.stack([places[:, :1] + c * x - s * y, places[:, 1:2] + s * x + c * y])
        index = (at - lows[face][:, None, None]) / RASTER_MM
        image = map_coordinates(rasters[face], index, order=1, mode="nearest")
        return _unit(np.clip(image, 0, None))

    area = np.array([len(face.rows) for face in world.faces.values()], float)
    owner = np.sort(rng.choice(len(names), TEMPLATES, p=area / area.sum()))
    places = np.empty((TEMPLATES, 3))
    bank = np.empty((TEMPLATES, len(tactels)), np.float32)
    for number, face in enumerate(world.faces.values()):
        some = owner == number
        at = face.centres_mm[rng.integers(len(face.rows), size=int(some.sum()))]
        at = at + rng.uniform(-0.5, 0.5, at.shape) * sensor.symbol_pitch_mm
        places[some] = np.c_[at, rng.uniform(-math.pi, math.pi, len(at))]
        bank[some] = render(number, places[some])

    def read(counts: NDArray[np.uint16]) -> ReaderAnswer | None:
        image = _unit(np.sqrt(counts.reshape(1, -1).astype(np.float64)))[0]
        if not image.any():
            return None
        alike = bank @ image
        found = []
        for k in np.argsort(alike)[-BEST:].tolist():
            face, best, place = int(owner[k]), float(alike[k]), places[k]
            for step_mm, step_rad in STEPS:
                for _ in range(4):
                    moves = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), axis=-1).reshape(-1, 3)
                    tried = place + moves * (step_mm, step_mm, step_rad)
                    scores = render(face, tried) @ image
                    if scores.max() <= best:
                        break
                    best, place = float(scores.max()), tried[int(scores.argmax())]
            found.append((best, face, place))
        best, face, place = max(found, key=lambda one: one[0])
        x, y, turn = place.tolist()
        return ReaderAnswer(names[face], x, y, turn, best)

    return read


def _unit(images: NDArray[Any]) -> NDArray[np.float32]:
    """Return images (n, k) without their mean, of unit length."""
    own = images - images.mean(axis=1, keepdims=True)
    size = np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-9)
    return np.asarray(own / size, np.float32)


def network(world: ReaderWorld) -> Read:
    """Return two small networks, trained on the touches of the public half, on a CPU.

    One names the face, or none of the set; one says place and turn. Each touch is learned as it is
    and turned by half a turn, which the matrix allows.
    """
    require("sklearn", extra="benchmark", purpose="the network of the benchmark")
    import warnings

    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPClassifier, MLPRegressor

    public, names = world.public, list(world.faces)
    images, turn = public["counts"], public["theta_rad"]
    known = public["label"] >= 0
    images = np.concatenate([images, images[:, ::-1, ::-1]])
    label = np.tile(public["label"], 2)
    turn = np.concatenate([turn, turn + math.pi])
    place = np.c_[np.tile(public["x_mm"], 2), np.tile(public["y_mm"], 2)] / 20.0
    some, inputs = np.tile(known, 2), _features(images)
    options = {"hidden_layer_sizes": LAYERS, "max_iter": EPOCHS, "random_state": 0}
    faces = np.eye(len(names) + 1)  # a row is the input that names a face
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        which = MLPClassifier(**options).fit(inputs, label)
        where = MLPRegressor(**options).fit(
            np.c_[inputs, faces[label]][some], np.c_[place, np.cos(turn), np.sin(turn)][some]
        )

    def read(counts: NDArray[np.uint16]) -> ReaderAnswer | None:
        image = _features(counts[None])
        shares = which.predict_proba(image)[0]
        label = int(which.classes_[shares.argmax()])
        if label < 0:
            return None
        x, y, c, s = where.predict(np.c_[image, faces[[label]]])[0].tolist()
        return ReaderAnswer(names[label], 20 * x, 20 * y, math.atan2(s, c), float(shares.max()))

    return read


def _features(counts: NDArray[Any]) -> NDArray[np.float32]:
    return _unit(np.sqrt(counts.reshape(len(counts), -1).astype(np.float64))) * 16


READERS: dict[str, BenchmarkReader] = {
    "ours": ours,
    "thesis": thesis,
    "template": template,
    "network": network,
    "chance": chance,
}
