"""Encode a wedge that cadquery made as mitred panels, and assemble them in cadquery."""

import cadquery

from generator import encode, to_cadquery

# A wedge: a trapezoid drawn in XZ, 40 mm deep.
wedge = cadquery.Workplane("XZ").polyline([(0, 0), (50, 0), (50, 30), (0, 40)]).close().extrude(40)

result = encode(
    wedge,
    name="Wedge",
    database="lab.db",
    folder="out/wedge",
    formats=["stl"],
    symbols={"height": "0.8 mm"},
)
print(f"{result.name}: {result.symbols} symbols on {len(result.parts)} panels")

# Each panel stands where the wedge has its face, 0.8 mm of symbols outside.
assembly = to_cadquery(result)
box = assembly.toCompound().BoundingBox()
print(f"assembled {box.xlen:.1f} x {box.ylen:.1f} x {box.zlen:.1f} mm")
