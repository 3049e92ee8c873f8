"""Encode a wedge that cadquery made as mitred panels, and assemble them in cadquery."""

import cadquery

from generator import encode, to_cadquery

# A wedge: a trapezoid drawn in XZ, 60 mm deep.
wedge = cadquery.Workplane("XZ").polyline([(0, 0), (70, 0), (70, 30), (30, 50), (0, 50)])
wedge = wedge.close().extrude(60)

result = encode(
    wedge,
    name="Wedge",
    database="lab.db",
    folder="out/wedge",
    formats=["stl"],
    symbols={"pitch": "8 mm"},
)
print(f"{result.name}: {result.symbols} symbols on {len(result.parts)} panels")

# The panels stand where the wedge had its faces: the space they enclose is the wedge less a wall.
assembly = to_cadquery(result)
box = assembly.toCompound().BoundingBox()
print(f"assembled {box.xlen:.1f} x {box.ylen:.1f} x {box.zlen:.1f} mm")
assembly.export("out/wedge/assembled.step")
