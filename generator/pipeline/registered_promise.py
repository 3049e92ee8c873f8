"""What the faces of a registered object promise, from the database alone.

Registered object -> by its face's number the share of single touches that are answered, as
`promise` tells it where the object is made. Nothing is said of round faces and of arrays that are
read by a scan.
"""

from __future__ import annotations

from generator.array.touches import SENSOR_MM, touches_needed
from generator.database.registered import RegisteredObject
from generator.layout.promise import measured_answers, promised_shares
from generator.layout.views import SensorView, face_views
from generator.pipeline.promise import face_key


def registered_promises(held: RegisteredObject) -> dict[int, float]:
    """Return the promise of each flat face with symbols; equal faces share the work."""
    array, style = held.array, held.style
    if touches_needed(array.order, array.rows * array.columns, style.pitch_mm) > 1:
        return {}
    reach = held.alphabet["reach"] * style.pitch_mm + style.stroke_mm / 2
    view = SensorView((SENSOR_MM / 2, SENSOR_MM / 2), reach)
    facets = {n for face in held.faces if face.round for n in face.round.surface.facets}
    layouts = {layout.face: layout for layout in held.layout.faces}
    known: dict[bytes, float] = {}
    found = {}
    for face in held.faces:
        layout = layouts.get(face.face_id)
        if layout is None or not len(layout.labels) or face.face_id in facets:
            continue
        key = face_key(face.polygon_mm, layout)
        if key not in known:
            views = face_views(face.polygon_mm, layout, style.pitch_mm, view)
            once, _ = promised_shares(views, measured_answers(), style.pitch_mm)
            known[key] = round(once, 3)
        found[face.face_id] = known[key]
    return found
