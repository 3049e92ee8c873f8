"""Decode windows: the thesis's own, one with a symbol missing, and one of a lab."""

from encoded_objects import decode, encode, open_lab

print(decode("01 11 01 01 00 01", profile="thesis"))
print(decode("01 11 0? 01 00 01", profile="thesis"))
print(decode("01 11 01 01 00 01", profile="thesis", method="table").t)

# With a lab's database the answer names the object and the face, too.
encode({"name": "Cube", "shape": {"cube": "60 mm"}}, database="lab.db", formats=["stl"])
face = open_lab("lab.db").arrays[0].face(0)
symbols = {(r, c): s for r, c, s in zip(face.rows, face.columns, face.labels, strict=True)}
row, column = next(
    (r, c) for r, c in symbols if all((r + i, c + j) in symbols for i in range(3) for j in range(3))
)
window = " ".join("".join(str(symbols[row + i, column + j]) for j in range(3)) for i in range(3))
found = decode(window, database="lab.db")
print(f"{window}: {found}, {found.object}/{found.face}")
