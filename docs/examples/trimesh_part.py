"""Encode a part that trimesh made; coplanar triangles become one face."""

import trimesh

from encoded_objects import encode

part = trimesh.creation.box((60, 40, 30))
part.apply_translation((10, 0, 0))

result = encode(part, name="Block", database="lab.db", formats=["stl", "3mf"])
print(result)
print(f"{result.places} places told apart by touch")
