"""Prims and their attributes -> the binary file of USD, Crate version 0.8 (`.usdc`).

Own bytes, so that one spec gives one file whatever OpenUSD is installed, or none. A file is its
values, then tables: tokens, fields (a name and a value), runs of fields, paths in depth-first
order, and specs, which give a path its run. Tables are packed as the format asks: whole numbers
as differences (`_packed`), all in blocks of LZ4, here of literals alone.
Source: OpenUSD, `pxr/usd/usd/crateFile.cpp`, `integerCoding.cpp`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from numpy.typing import ArrayLike, NDArray

Value = bool | float | str | Sequence[str] | ArrayLike
Field = tuple[str, int]  #: name, and value as `_rep` makes it

_VERSION = bytes([0, 8, 0])
_HEADER = struct.Struct("<8s8sq64x")  #: mark, version, where the table of sections is
_ARRAY, _INLINE, _COMPRESSED = 1 << 63, 1 << 62, 1 << 61
#: of a value: its number in the format; of numbers in an array also what they are
_BOOL, _TOKEN, _STRING, _TOKEN_LIST, _TOKENS, _SPECIFIER, _VARIABILITY = 1, 11, 10, 32, 41, 42, 44
_NUMBERS = {
    "int": (3, "<i4"), "float": (8, "<f4"), "double": (9, "<f8"), "quatf": (17, "<f4"),
    "float3": (24, "<f4"), "point3f": (24, "<f4"), "normal3f": (24, "<f4"), "color3f": (24, "<f4"),
    "matrix4d": (15, "<f8"),
}  # fmt: skip
_PREPENDED = 1 << 5  #: of a list of tokens
_LEAST_PACKED = 16  #: whole numbers; fewer stand as they are
_ATTRIBUTE, _PRIM, _ROOT = 1, 6, 7  #: what a spec is of


@dataclass(frozen=True, slots=True, eq=False)
class Attribute:
    """A value with its type, as text files of USD name it: "point3f[]"."""

    type: str
    value: Value
    uniform: bool = False
    interpolation: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Prim:
    """A prim with what is below it."""

    name: str
    type: str
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    children: Sequence[Prim] = ()
    schemas: tuple[str, ...] = ()
    kind: str = ""
    display_name: str = ""


def crate_chunks(root: Prim) -> Iterator[bytes]:
    """Yield the file of a stage in metres and kilograms, z up, with one prim at its root."""
    crate = _Crate()
    fields = [
        ("defaultPrim", crate.token(root.name)), ("kilogramsPerUnit", crate.number("double", 1.0)),
        ("metersPerUnit", crate.number("double", 1.0)), ("upAxis", crate.token("Z")),
        ("primChildren", crate.tokens([root.name])),
    ]  # fmt: skip
    place = crate.add("", _ROOT, fields)
    crate.add_prim(root)
    crate.jumps[place] = -1
    return crate.chunks()


class _Crate:
    def __init__(self) -> None:
        self.values: list[bytes] = []
        self.size = _HEADER.size
        self.names: dict[str, int] = {"": 0}  # a property's path has its name's number, negative
        self.strings: list[int] = []
        self.fields: list[tuple[int, int]] = []
        self.runs: list[int] = []
        self.elements: list[int] = []
        self.jumps: list[int] = []
        self.specs: list[tuple[int, int]] = []  # start of its run, what it is of

    def add_prim(self, prim: Prim, *, last: bool = True) -> None:
        """Add a prim, its attributes and what is below it."""
        fields = [("specifier", _rep(_SPECIFIER, 0)), ("typeName", self.token(prim.type))]
        if prim.schemas:
            names = struct.pack("<BQ", _PREPENDED, len(prim.schemas)) + self._numbers(prim.schemas)
            fields.append(("apiSchemas", self._stored(_TOKEN_LIST, names)))
        if prim.kind:
            fields.append(("kind", self.token(prim.kind)))
        if prim.display_name:
            self.strings.append(self._name(prim.display_name))
            fields.append(("displayName", _rep(_STRING, len(self.strings) - 1)))
        if prim.attributes:
            fields.append(("properties", self.tokens(list(prim.attributes))))
        if prim.children:
            fields.append(("primChildren", self.tokens([child.name for child in prim.children])))
        place = self.add(prim.name, _PRIM, fields)
        left = count(len(prim.attributes) + len(prim.children) - 1, -1)
        for name, attribute in prim.attributes.items():
            at = self.add(name, _ATTRIBUTE, self._attribute(attribute))
            self.jumps[at] = 0 if next(left) else -2
        for child in prim.children:
            self.add_prim(child, last=not next(left))
        below = len(self.jumps) - place > 1
        self.jumps[place] = (-1 if below else -2) if last else (len(self.jumps) - place) * below

    def add(self, name: str, kind: int, fields: Sequence[Field]) -> int:
        """Add a spec of a path; return its place among paths."""
        number = self._name(name)
        self.elements.append(-number if kind == _ATTRIBUTE else number)
        self.jumps.append(0)
        self.specs.append((len(self.runs), kind))
        self.runs += [*range(len(self.fields), len(self.fields) + len(fields)), -1]
        self.fields += [(self._name(key), value) for key, value in fields]
        return len(self.specs) - 1

    def token(self, text: str) -> int:
        return _rep(_TOKEN, self._name(text))

    def tokens(self, texts: Sequence[str]) -> int:
        return self._stored(_TOKENS, struct.pack("<Q", len(texts)) + self._numbers(texts))

    def number(self, kind: str, value: ArrayLike) -> int:
        """Return the value of a number, a vector or a matrix, or of an array ("[]") of them."""
        number, item = _NUMBERS[kind.removesuffix("[]")]
        values = np.ascontiguousarray(value, item) + 0  # no negative zero
        if not kind.endswith("[]"):
            if values.nbytes == 4:
                return _rep(number, int.from_bytes(values.tobytes(), "little"))
            return self._stored(number, values.tobytes())
        size = struct.pack("<Q", len(values))
        if kind == "int[]" and values.size >= _LEAST_PACKED:
            return self._stored(number, size + _packed(values), _ARRAY | _COMPRESSED)
        return self._stored(number, size + values.tobytes(), _ARRAY)

    def chunks(self) -> Iterator[bytes]:
        """Yield the file."""
        names = b"".join(name.encode() + b"\0" for name in self.names)
        starts, kinds = zip(*self.specs, strict=True)
        places = range(len(self.specs))
        keys, values = zip(*self.fields, strict=True)
        literal = _literal(names)
        reps = _literal(np.array(values, "<u8").tobytes())
        paths = b"".join(map(_packed, (places, self.elements, self.jumps)))
        sections = {
            "TOKENS": (len(self.names), struct.pack("<QQ", len(names), len(literal)) + literal),
            "STRINGS": (len(self.strings), np.array(self.strings, "<u4").tobytes()),
            "FIELDS": (len(keys), _packed(keys) + struct.pack("<Q", len(reps)) + reps),
            "FIELDSETS": (len(self.runs), _packed(self.runs)),
            "PATHS": (len(places), struct.pack("<Q", len(places)) + paths),
            "SPECS": (len(places), b"".join(map(_packed, (places, starts, kinds)))),
        }
        table, at = struct.pack("<Q", len(sections)), self.size
        for name, (_, content) in sections.items():
            table += struct.pack("<16sqq", name.encode(), at, 8 + len(content))
            at += 8 + len(content)
        yield _HEADER.pack(b"PXR-USDC", _VERSION, at)
        yield from self.values
        for number, content in sections.values():
            yield struct.pack("<Q", number) + content
        yield table

    def _attribute(self, attribute: Attribute) -> list[Field]:
        kind, value = attribute.type, attribute.value
        if kind == "token":
            rep = self.token(str(value))
        elif kind == "token[]":
            content = struct.pack("<Q", len(value)) + self._numbers(value)  # type: ignore[arg-type]
            rep = self._stored(_TOKEN, content, _ARRAY)
        elif kind == "bool":
            rep = _rep(_BOOL, int(bool(value)))
        else:
            rep = self.number(kind, value)
        fields = [("typeName", self.token(kind)), ("default", rep)]
        if attribute.uniform:
            fields.append(("variability", _rep(_VARIABILITY, 1)))
        if attribute.interpolation:
            fields.append(("interpolation", self.token(attribute.interpolation)))
        return fields

    def _name(self, text: str) -> int:
        return self.names.setdefault(text, len(self.names))

    def _numbers(self, texts: Sequence[str]) -> bytes:
        return np.array([self._name(text) for text in texts], "<u4").tobytes()

    def _stored(self, kind: int, content: bytes, flags: int = 0) -> int:
        start, padding = self.size, -len(content) % 8
        self.values += [content, bytes(padding)]
        self.size += len(content) + padding
        return flags | kind << 48 | start


def _rep(kind: int, payload: int) -> int:
    """Return a value that stands where it is named."""
    return _INLINE | kind << 48 | payload


def _packed(numbers: ArrayLike) -> bytes:
    """Return 32-bit whole numbers as the format packs them, with their size before.

    Differences to the one before, the first to 0: the commonest; for each a code of two bits
    (the commonest, 1 byte, 2 bytes, 4 bytes); then the bytes.
    """
    steps = np.diff(np.asarray(numbers, np.int64).ravel(), prepend=0).astype("<i4")
    found, times = np.unique(steps, return_counts=True)
    common = found[np.argmax(times)]
    codes = np.where(np.abs(steps + 0.5) < 128, 1, np.where(np.abs(steps + 0.5) < 32768, 2, 3))
    codes[steps == common] = 0
    wide = np.zeros(-(-len(codes) // 4) * 4, np.uint8)
    wide[: len(codes)] = codes
    bits: NDArray[np.uint8] = (wide.reshape(-1, 4) << [0, 2, 4, 6]).sum(axis=1, dtype=np.uint8)
    kept = np.arange(4) < np.array([0, 1, 2, 4])[codes][:, None]
    data = steps.view(np.uint8).reshape(-1, 4)[kept]
    content = _literal(common.tobytes() + bits.tobytes() + data.tobytes())
    return struct.pack("<Q", len(content)) + content


def _literal(content: bytes) -> bytes:
    """Return one chunk with one block of LZ4 that copies `content`."""
    size = len(content)
    if size < 15:
        return bytes([0, size << 4]) + content
    return bytes([0, 0xF0]) + b"\xff" * ((size - 15) // 255) + bytes([(size - 15) % 255]) + content
