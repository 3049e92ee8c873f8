"""What the faces of a registered object promise, from the database alone.

Registered object + sensor -> by its face's number the shares of touches that are answered at once
and within three, as `promise` tells them where the object is made. Nothing is said of round faces
and of arrays that are read by a scan.
"""

from __future__ import annotations

from encoded_objects.base.sensor_type import USUAL_SENSOR, SensorType
from generator.array.touches import touches_needed
from generator.database.registered import RegisteredObject
from generator.layout.views import face_views, sensor_view
from generator.pipeline.promise import FacePromise, face_key, promise_of


def registered_promises(
    held: RegisteredObject, sensor: SensorType = USUAL_SENSOR
) -> dict[int, FacePromise]:
    """Return the promise of each flat face with symbols; equal faces share the work.

    Parameters
    ----------
    held
        The object.
    sensor
        What touches it.
    """
    array, style = held.array, held.style
    cells = array.rows * array.columns
    if touches_needed(array.order, cells, style.pitch_mm, sensor_mm=sensor.across_mm) > 1:
        return {}
    reach = held.alphabet["reach"] * style.pitch_mm + style.stroke_mm / 2
    view = sensor_view(sensor, reach)
    facets = {n for face in held.faces if face.round for n in face.round.surface.facets}
    layouts = {layout.face: layout for layout in held.layout.faces}
    known: dict[bytes, FacePromise] = {}
    found = {}
    for face in held.faces:
        layout = layouts.get(face.face_id)
        if layout is None or not len(layout.labels) or face.face_id in facets:
            continue
        key = face_key(face.polygon_mm, layout)
        if key not in known:
            views = face_views(face.polygon_mm, layout, style.pitch_mm, view)
            known[key] = promise_of(views, style.pitch_mm, sensor)
        found[face.face_id] = known[key]
    return found
