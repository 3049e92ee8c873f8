"""How large each extra is as installed: its packages beyond those that everybody gets.

    python tests/campaigns/extras.py

Follows the requirements in pyproject.toml through the installed distributions and sums the files
that each lists, without compiled caches. Run it where all extras are installed.
"""

from __future__ import annotations

import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
Seen = set[tuple[str, frozenset[str]]]


def requirements(name: str, extras: frozenset[str]) -> list[str]:
    """Return what a distribution asks for, given its extras."""
    if name == PROJECT["name"]:
        own = PROJECT["optional-dependencies"]
        return [*PROJECT["dependencies"], *(text for extra in extras for text in own[extra])]
    wanted = []
    for text in distribution(name).requires or []:
        marker = Requirement(text).marker
        if marker is None or any(marker.evaluate({"extra": e}) for e in extras or {""}):
            wanted.append(text)
    return wanted


def needed(name: str, extras: frozenset[str], seen: Seen) -> set[str]:
    """Return all distributions that one needs, itself among them; with a `?` what is not there."""
    if (name, extras) in seen:
        return set()
    seen.add((name, extras))
    found = {name}
    try:
        for text in requirements(name, extras):
            one = Requirement(text)
            found |= needed(one.name.lower().replace("_", "-"), frozenset(one.extras), seen)
    except PackageNotFoundError:
        return {f"{name}?"}
    return found


def megabytes(name: str) -> float:
    """Return what a distribution takes as installed."""
    files = [file for file in distribution(name).files or [] if file.suffix != ".pyc"]
    paths = [Path(str(file.locate())) for file in files]
    return sum(path.stat().st_size for path in paths if path.exists()) / 1e6


def main() -> None:
    """Print a table."""
    name = PROJECT["name"]
    base = needed(name, frozenset(), set()) - {name}
    print("| extra | packages | MB | largest |\n| --- | --- | --- | --- |")
    for extra in ("", *sorted(PROJECT["optional-dependencies"])):
        own = needed(name, frozenset({extra}), set()) - {name} - base if extra else base
        sizes = {one: megabytes(one) for one in own if not one.endswith("?")}
        absent = sorted(one[:-1] for one in own if one.endswith("?"))
        largest = [f"{one} {sizes[one]:.0f}" for one in sorted(sizes, key=lambda n: -sizes[n])[:3]]
        told = ", ".join(largest) + (f"; not there: {', '.join(absent)}" if absent else "")
        print(f"| {extra or 'none'} | {len(own)} | {sum(sizes.values()):.0f} | {told} |")


if __name__ == "__main__":
    main()
