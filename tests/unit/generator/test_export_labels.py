"""Names of faces: only where the face is seen, on the face, never one over another."""

from __future__ import annotations

import numpy as np

from generator.export.lettering import HALF_HEIGHT, Label, place_labels

STEP = 4.0


def wanted_at(face: int, x: float, y: float, half_width: float) -> Label:
    return Label(face, "", x, y, half_width)


def places_of(seen: np.ndarray, step: float, wanted: list[Label]) -> list[tuple | None]:
    return [one and (one.x, one.y) for one in place_labels(seen, step, wanted)]


def the_map() -> np.ndarray:
    """400 x 400 px: a large face 0 with face 1 in front of its middle; face 2 shows 4 places."""
    seen = np.full((100, 100), -1)
    seen[10:90, 10:90] = 0
    seen[40:60, 40:60] = 1
    seen[5:7, 5:7] = 2
    return seen


def test_hidden_faces_have_no_name() -> None:
    wanted = [wanted_at(2, 24.0, 24.0, 20.0), wanted_at(3, 200.0, 200.0, 20.0)]
    assert places_of(the_map(), STEP, wanted) == [None, None]
    assert places_of(np.full((100, 100), -1), STEP, wanted) == [None, None]


def test_a_covered_middle_gives_way_to_what_is_seen() -> None:
    (place,) = places_of(the_map(), STEP, [wanted_at(0, 200.0, 200.0, 20.0)])
    assert place is not None
    x, y = place
    assert the_map()[int(y / STEP), int(x / STEP)] == 0
    own = the_map()[
        int((y - HALF_HEIGHT) / STEP) : int((y + HALF_HEIGHT) / STEP) + 1,
        int((x - 20) / STEP) : int((x + 20) / STEP) + 1,
    ]
    assert (own == 0).mean() > 0.8


def test_labels_do_not_overlap() -> None:
    seen = np.full((60, 60), -1)
    for k in range(6):
        seen[20:40, 6 * k + 10 : 6 * k + 16] = k
    wanted = [wanted_at(k, STEP * (6 * k + 13), 120.0, 18.0) for k in range(6)]
    places = places_of(seen, STEP, wanted)
    found = [place for place in places if place is not None]
    assert len(found) >= 5
    for k, (x, y) in enumerate(found):
        for other_x, other_y in found[:k]:
            assert abs(x - other_x) >= 36 or abs(y - other_y) >= 2 * HALF_HEIGHT


def test_a_label_stays_in_the_picture() -> None:
    seen = np.full((30, 60), 0)
    (place,) = places_of(seen, STEP, [wanted_at(0, 2.0, 60.0, 70.0)])
    assert place is not None
    assert 70.0 <= place[0] <= 60 * STEP - 70.0
    assert places_of(seen, STEP, [wanted_at(0, 2.0, 60.0, 500.0)]) == [None]
