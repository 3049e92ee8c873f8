"""What slicers write in comments: features, widths, heights, the filament.

Read: PrusaSlicer and its kin (`;TYPE:External perimeter`, `;WIDTH:0.45`, `;HEIGHT:0.2`), Cura
(`;TYPE:WALL-OUTER`; it says neither width nor height), Bambu Studio and OrcaSlicer for Bambu
printers (`; FEATURE: Outer wall`, `; LINE_WIDTH: 0.42`, `; LAYER_HEIGHT: 0.2`).
"""

from __future__ import annotations

import re

from generator.printed.toolpath import ROLES

#: A comment that says something of the moves after it, and what it says.
NOTE = re.compile(
    r";\s*(TYPE|FEATURE|WIDTH|LINE_WIDTH|HEIGHT|LAYER_HEIGHT|filament_diameter)\s*[:=]\s*(.+)"
)
ROLE_NOTES = ("TYPE", "FEATURE")
WIDTH_NOTES = ("WIDTH", "LINE_WIDTH")
HEIGHT_NOTES = ("HEIGHT", "LAYER_HEIGHT")

#: Comments by which Cura says that E is a volume.
VOLUMETRIC = (";FLAVOR:Marlin(Volumetric)", ";FLAVOR:UltiGCode")

_DIALECTS = (
    ("prusaslicer", "prusaslicer"),
    ("superslicer", "prusaslicer"),
    ("slic3r", "prusaslicer"),
    ("bambustudio", "bambu"),
    ("orcaslicer", "orca"),
    ("cura_steamengine", "cura"),
    ("flavor:", "cura"),
)

# The first entry whose words all stand in a feature's name names its role.
_FEATURES = (
    ("skirt", ("skirt",)),
    ("skirt", ("brim",)),
    ("support", ("support",)),
    ("support", ("tower",)),
    ("support", ("wipe",)),
    ("support", ("prime",)),
    ("custom", ("custom",)),
    ("ironing", ("ironing",)),
    ("overhang", ("overhang",)),
    ("bridge", ("bridge",)),
    ("gap fill", ("gap",)),
    ("gap fill", ("thin wall",)),
    ("outer wall", ("external perimeter",)),
    ("outer wall", ("outer",)),
    ("inner wall", ("perimeter",)),
    ("inner wall", ("inner",)),
    ("top", ("top",)),
    ("solid", ("solid",)),
    ("solid", ("bottom",)),
    ("solid", ("skin",)),
    ("infill", ("fill",)),
    ("infill", ("sparse",)),
)


def dialect_of(comment: str) -> str:
    """Return the dialect that a comment names, or nothing."""
    text = comment.lower()
    return next((dialect for mark, dialect in _DIALECTS if mark in text), "")


def role_of(feature: str) -> int:
    """Return the role of a feature by its name in any of the dialects.

    >>> ROLES[role_of("External perimeter")], ROLES[role_of("WALL-OUTER")]
    ('outer wall', 'outer wall')
    """
    text = feature.strip().lower()
    for role, words in _FEATURES:
        if all(word in text for word in words):
            return ROLES.index(role)
    return 0
