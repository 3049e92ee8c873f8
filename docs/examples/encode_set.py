"""Encode a set: two objects that share one array, and a third one that joins them later."""

from encoded_objects import encode

pair = {
    "objects": [
        {"name": "Cube", "shape": {"cube": "40 mm"}},
        {"name": "Box", "shape": {"box": "50 x 40 x 30 mm"}, "copies": 2},
    ],
}
made = encode(pair, database="lab.db", folder="out", formats=["stl", "3mf"])
print(made)

# Next month, in the same database: no cell is used twice.
prism = {"name": "Prism", "shape": {"triangular_prism": {"side": "50 mm", "height": "40 mm"}}}
later = encode(prism, database="lab.db", folder="out/Prism", formats=["stl"])
print(f"{later.used_cells} of {later.rows * later.columns} cells in use")
