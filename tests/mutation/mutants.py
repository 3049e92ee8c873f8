"""A module's source -> the same source with one thing changed, once for every such change.

What is changed: numbers, wherever they stand (constants, defaults, bounds, axes); signs and
arithmetic; comparisons and their bounds; and, or, not; True, False; and functions that have
an opposite (min and max, sine and cosine, argmin and argmax, ...). What is not: annotations,
messages of errors, decorators, docstrings, and what only makes the program stop earlier
(`strict=True` of zip).
"""

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass

_ARITHMETIC = """Add + -, Sub - +, Mult * /, Div / *, FloorDiv // *, Mod % +, Pow ** *,
    LShift << >>, RShift >> <<, BitAnd & |, BitOr | &, BitXor ^ |, MatMult @ *"""
ARITHMETIC = {  # operator: how it is written, and what is put there
    getattr(ast, name): signs for name, *signs in map(str.split, _ARITHMETIC.split(","))
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
_PAIRS = "min max, minimum maximum, argmin argmax, sin cos, floor ceil, any all, zeros ones"
OPPOSITES = {a: b for x, y in map(str.split, _PAIRS.split(",")) for a, b in ((x, y), (y, x))}
LARGE = 16  #: whole numbers from which on one more or less is no other number


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change."""

    place: str  #: function, class or "module" that holds it
    line: int
    column: int
    before: str  #: the line, stripped
    after: str
    source: str  #: of the whole module

    @property
    def name(self) -> str:
        """Return what tells it apart from others while lines above it come and go."""
        return f"{self.place}: `{self.before}` -> `{self.after}`"


def mutants_of(source: str) -> Iterator[Mutant]:
    """Yield every mutant of a module, in the order of the text; names are unique."""
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    text = source.encode()
    names: set[str] = set()
    found = sorted(set(_changes(ast.parse(source), text, starts)))
    for first, last, new, place in found:
        line = next(n for n, start in enumerate(starts) if start > first) - 1
        whole = text[:first] + new.encode() + text[last:]
        end = next(start for start in starts if start >= last)
        row = whole[starts[line] : end + len(new.encode()) - (last - first)].decode()
        before, column = _bare(text[starts[line] : end].decode()), first - starts[line]
        mutant = Mutant(place, line + 1, column, before, _bare(row), whole.decode())
        if mutant.name not in names:
            names.add(mutant.name)
            yield mutant


def _bare(line: str) -> str:
    """Return a line without its comment and indentation."""
    return " ".join(line.split("  #")[0].split())


Span = Callable[[ast.expr], tuple[int, int]]
Between = Callable[[ast.expr, ast.expr, str], tuple[int, int]]
_Change = tuple[int, int, str, str]  # bytes from ... to, what is put there, place


def _changes(tree: ast.Module, text: bytes, starts: list[int]) -> Iterator[_Change]:
    def span(node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            starts[node.lineno - 1] + node.col_offset,
            starts[node.end_lineno - 1] + node.end_col_offset,
        )

    def between(a: ast.expr, b: ast.expr, token: str) -> tuple[int, int]:
        first, last = span(a)[1], span(b)[0]
        gap = text[first:last]
        code = b"\n".join(  # comments are blanked, so that the token is not found there
            row.split(b"#")[0].ljust(len(row)) for row in gap.split(b"\n")
        )
        at = first + code.index(token.encode())
        return at, at + len(token)

    def visit(node: ast.AST, place: str) -> Iterator[_Change]:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inner = node.name if place == "module" else f"{place}.{node.name}"
            for child in _children(node):
                yield from visit(child, inner)
            return
        for first, last, new in _of_node(node, span, between):
            yield first, last, new, place
        for child in _children(node):
            yield from visit(child, place)

    yield from visit(tree, "module")


def _children(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a node that may be changed."""
    skipped: set[str] = {"annotation", "returns", "decorator_list", "type_comment"}
    if isinstance(node, ast.Raise | ast.JoinedStr):
        return
    if isinstance(node, ast.keyword) and node.arg in ("strict", "fix", "place"):
        return
    for name, value in ast.iter_fields(node):
        if name in skipped:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield child


def _of_node(node: ast.AST, span: Span, between: Between) -> Iterator[tuple[int, int, str]]:
    if isinstance(node, ast.Constant):
        for new in _other_values(node.value):
            yield *span(node), new
    elif isinstance(node, ast.BinOp):
        old, new = ARITHMETIC[type(node.op)]
        yield *between(node.left, node.right, old), new
    elif isinstance(node, ast.AugAssign):
        old, new = ARITHMETIC[type(node.op)]
        first, _ = between(node.target, node.value, old + "=")
        yield first, first + len(old), new
    elif isinstance(node, ast.UnaryOp):
        first, _ = span(node)
        yield first, first + (3 if isinstance(node.op, ast.Not) else 1), ""
    elif isinstance(node, ast.BoolOp):
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for a, b in zip(node.values, node.values[1:], strict=False):
            yield *between(a, b, old), new
    elif isinstance(node, ast.Compare):
        for a, operator, b in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            old, others = COMPARISONS[type(operator)]
            for new in others:
                yield *between(a, b, old), new
    elif isinstance(node, ast.If | ast.While | ast.IfExp):
        yield from _negated(node.test, span)
    elif isinstance(node, ast.comprehension):
        for test in node.ifs:
            yield from _negated(test, span)
    elif isinstance(node, ast.Attribute) and node.attr in OPPOSITES:
        last = span(node)[1]
        yield last - len(node.attr), last, OPPOSITES[node.attr]
    elif isinstance(node, ast.Name) and node.id in ("min", "max", "any", "all"):
        yield *span(node), OPPOSITES[node.id]


def _negated(test: ast.expr, span: Span) -> Iterator[tuple[int, int, str]]:
    """Yield a name or a call negated; what has an operator is changed at the operator."""
    if isinstance(test, ast.Name | ast.Attribute | ast.Call | ast.Subscript):
        first, _ = span(test)
        yield first, first, "not "


def _other_values(value: object) -> Iterator[str]:
    if isinstance(value, bool):
        yield str(not value)
    elif isinstance(value, int):
        others = (2 * value, value // 2) if value >= LARGE else (value + 1, value - 1)
        yield from map(str, others)
    elif isinstance(value, float):
        yield from (repr(2 * value), repr(value / 2)) if value else ("1.0",)
