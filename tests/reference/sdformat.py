"""What SDFormat 1.9 allows, for the elements of a rigid model; http://sdformat.org/spec?ver=1.9.

Element -> its attributes (True: must be there) and its children ("1": must be there once,
"?": at most once, "*": as often as wanted). Values are checked by their type, names by the rules
of scopes: no two frames, links or joints of a model share one, none is reserved.
"""

from __future__ import annotations

from xml.etree import ElementTree

POSE = {"pose": "?"}
DRAKE = "{http://drake.mit.edu}proximity_properties"  # elements of other namespaces are allowed
SPECIFICATION: dict[str, tuple[dict[str, bool], dict[str, str]]] = {
    "sdf": ({"version": True}, {"model": "?", "world": "*"}),
    "model": (
        {"name": True, "canonical_link": False, "placement_frame": False},
        {"static": "?", "self_collide": "?", "frame": "*", "link": "*", "joint": "*", **POSE},
    ),
    "frame": ({"name": True, "attached_to": False}, POSE),
    "link": (
        {"name": True},
        {"gravity": "?", "inertial": "?", "collision": "*", "visual": "*", **POSE},
    ),
    "inertial": ({}, {"mass": "?", "inertia": "?", **POSE}),
    "inertia": ({}, dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "1")),
    "visual": ({"name": True}, {"geometry": "1", "material": "?", "transparency": "?", **POSE}),
    "collision": ({"name": True}, {"geometry": "1", "surface": "?", DRAKE: "?", **POSE}),
    DRAKE: ({}, {"{http://drake.mit.edu}rigid_hydroelastic": "?"}),
    "geometry": ({}, {"mesh": "?", "box": "?"}),
    "mesh": ({}, {"uri": "1", "submesh": "?", "scale": "?"}),
    "material": ({}, {"ambient": "?", "diffuse": "?", "specular": "?", "emissive": "?"}),
}
NUMBERS = {"pose": 6, "mass": 1, "ambient": 4, "diffuse": 4} | dict.fromkeys(
    ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1
)
ATTRIBUTES = {"pose": {"relative_to": False, "rotation_format": False, "degrees": False}}


def faults(text: bytes) -> list[str]:
    """Return what SDFormat forbids in a file."""
    root = ElementTree.fromstring(text)
    found = [] if root.tag == "sdf" else [f"the root is {root.tag}"]
    if root.get("version") != "1.9":
        found.append(f"version {root.get('version')}")
    _check(root, found)
    for model in root.iter("model"):
        links = [link.get("name") for link in model.findall("link")]
        names = links + [frame.get("name") for frame in model.findall("frame")]
        found += [f"'{name}' twice" for name in set(names) if names.count(name) > 1]
        known = {*names, "__model__"}
        for element in model.iter():
            for key in ("attached_to", "relative_to"):
                if element.get(key, "__model__") not in known:
                    found.append(f"{key} '{element.get(key)}' is no frame")
        if not links:
            found.append("a model without links")
        for link in model.findall("link"):
            for kind in ("visual", "collision"):
                own = [each.get("name") for each in link.findall(kind)]
                found += [f"{kind} '{name}' twice" for name in set(own) if own.count(name) > 1]
    return found


def _check(element: ElementTree.Element, found: list[str]) -> None:
    tag = element.tag
    attributes, children = SPECIFICATION.get(tag, (ATTRIBUTES.get(tag, {}), {}))
    for name, needed in attributes.items():
        if needed and not element.get(name):
            found.append(f"{tag} without {name}")
    found += [f"{tag} with {name}" for name in element.attrib if name not in attributes]
    name = element.get("name", "")
    if "::" in name or (name.startswith("__") and name.endswith("__")):
        found.append(f"the name '{name}' is reserved")
    if tag in NUMBERS:
        values = list(map(float, (element.text or "").split()))
        if len(values) != NUMBERS[tag]:
            found.append(f"{tag} of {len(values)} numbers")
    counts: dict[str, int] = {}
    for child in element:
        counts[child.tag] = counts.get(child.tag, 0) + 1
        _check(child, found)
    for kind, count in counts.items():
        if kind not in children:
            found.append(f"{kind} in {tag}")
        elif count > 1 and children[kind] != "*":
            found.append(f"{count} {kind} in {tag}")
    found += [
        f"{tag} without {kind}"
        for kind, how in children.items()
        if how == "1" and kind not in counts
    ]
