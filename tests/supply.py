"""What the project is built on: its versions, and what is known against them.

    .venv/bin/python tests/supply.py constraints     # write constraints.txt from what is installed
    .venv/bin/python tests/supply.py advisories      # known advisories of what is installed

`constraints.txt` pins every package that `encoded-objects[test]` brings, in the versions with which
the tests passed; README's commands install by it. Make it again in a fresh environment that was
installed without it.

Advisories are asked of OSV (https://osv.dev) in one request, and kept with their date in
`advisories.json`; without a network that file answers, and its date is said. Exit code 1 where
there are any, 2 where nothing can be asked and nothing is kept.
"""

import argparse
import json
import re
import sys
import tomllib
import urllib.request
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
CONSTRAINTS = ROOT / "constraints.txt"
OSV = "https://api.osv.dev/v1/querybatch"
PATIENCE_S = 30.0
HEAD = """# Versions with which the tests passed, on Python {}.{}; made by
# .venv/bin/python tests/supply.py constraints
"""


def canonical(name: str) -> str:
    """Return the name of a package as registries compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def declared() -> dict[str, list[Requirement]]:
    """Return the direct requirements of pyproject.toml by extra; "" for a plain install."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = {"": project["dependencies"], **project["optional-dependencies"]}
    return {extra: [Requirement(one) for one in listed] for extra, listed in extras.items()}


def needed() -> dict[str, str]:
    """Return all packages that `encoded-objects[test]` brings, with their installed versions."""
    known, extras = {}, declared()
    waiting = [*extras[""], *extras["test"]]
    seen = set()
    while waiting:
        one = waiting.pop()
        name = canonical(one.name)
        if name == "encoded-objects":
            waiting += [each for extra in one.extras for each in extras[extra]]
            continue
        key = (name, frozenset(one.extras))
        asked = [{"extra": extra} for extra in ("", *one.extras)]
        if key in seen or (one.marker and not one.marker.evaluate({"extra": ""})):
            continue
        seen.add(key)
        found = metadata.distribution(name)
        known[name] = found.version
        for text in found.requires or ():
            other = Requirement(text)
            if other.marker is None or any(map(other.marker.evaluate, asked)):
                other.marker = None
                waiting.append(other)
    return known


def advisories(url: str, kept: Path) -> int:
    """Print what is known against the installed versions; returns the exit code."""
    versions = sorted(needed().items())
    queries = [
        {"package": {"name": name, "ecosystem": "PyPI"}, "version": version}
        for name, version in versions
    ]
    request = urllib.request.Request(url, json.dumps({"queries": queries}).encode())
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            results = json.load(answer)["results"]
        found = {
            f"{name}=={version}": sorted(one["id"] for one in result.get("vulns", ()))
            for (name, version), result in zip(versions, results, strict=True)
        }
        told = {"asked": datetime.now(UTC).isoformat(timespec="seconds"), "of": url, "found": found}
        kept.write_text(json.dumps(told, indent=1) + "\n", "utf-8")
    except OSError as error:
        print(f"{url} does not answer: {error}", file=sys.stderr)
        if not kept.is_file():
            print(f"  fix: run it where there is a network, and keep {kept.name}", file=sys.stderr)
            return 2
        told = json.loads(kept.read_text("utf-8"))
    unknown = [f"{name}=={version}" for name, version in versions
               if f"{name}=={version}" not in told["found"]]  # fmt: skip
    bad = {name: ids for name, ids in told["found"].items() if ids}
    for name, ids in bad.items():
        print(f"{name}: {', '.join(f'https://osv.dev/vulnerability/{one}' for one in ids)}")
    print(
        f"{len(bad)} of {len(told['found'])} packages have known advisories, as of {told['asked']}"
    )
    if unknown:
        print(f"not asked then: {', '.join(unknown)}")
    return int(bool(bad))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("constraints", "advisories"))
    parser.add_argument("--url", default=OSV, help="another server that speaks OSV")
    parser.add_argument("--kept", type=Path, default=Path("advisories.json"), help="last answer")
    asked = parser.parse_args()
    if asked.what == "advisories":
        return advisories(asked.url, asked.kept)
    lines = [f"{name}=={version}\n" for name, version in sorted(needed().items())]
    CONSTRAINTS.write_text(HEAD.format(*sys.version_info) + "".join(lines), "utf-8")
    print(f"{CONSTRAINTS.name}: {len(lines)} packages")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
