"""Make the corpora again on purpose, or compare them with what is stored.

    python tests/corpora/make.py                    # all: store, and print what changed
    python tests/corpora/make.py answers            # one
    python tests/corpora/make.py --check            # store nothing, exit 1 on a difference
    python tests/corpora/make.py --check answers/own counts

README.md of this folder says what a corpus is. Runs from any folder.
"""

import argparse
import gzip
import json
import os
import sys
import time
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import psutil

#: Modules of this folder, one corpus each.
CORPORA: tuple[str, ...] = ("answers", "bytes", "counts", "databases", "recordings", "texts")

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
#: Set before numpy loads: one thread, and the instructions that every x86 machine since 2013 has,
#: so that sums are rounded alike. Programs that a corpus starts inherit it.
ENVIRONMENT = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": (
        "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4"
    ),
    **{f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")},
    "PYTHONHASHSEED": "0",
    "PYTHONPATH": str(ROOT),
    "SOURCE_DATE_EPOCH": "0",
    "TZ": "UTC",
    "LC_ALL": "C.UTF-8",
    "COLUMNS": "100",
    "NO_COLOR": "1",
}
UNSET = ("FORCE_COLOR",)
RELATIVE, ABSOLUTE = 1e-9, 1e-12  #: by which numbers that are not whole may differ
DIGITS = 12  #: of a number that is stored
COMPRESSED_FROM = 1_000_000  #: bytes of a stored corpus
SHOWN = 8  #: entries of each kind, and values of an entry, that are printed

Entries = dict[str, Any]


def parts_of(corpus: str) -> tuple[str, ...]:
    """Return the parts of a corpus that can be made alone, as CORPUS/PART; itself if it has none.

    A corpus may name `PARTS`. `collect(part)` then yields the entries of one part, whose names
    begin with "PART/".
    """
    parts = getattr(module_of(corpus), "PARTS", ())
    return tuple(f"{corpus}/{part}" for part in parts) or (corpus,)


def module_of(corpus: str) -> ModuleType:
    """Import the module of a corpus."""
    return import_module(f"corpora.{corpus}")


def collect(wanted: str) -> Entries:
    """Return the entries of CORPUS or CORPUS/PART as the code makes them now."""
    corpus, _, only = wanted.partition("/")
    entries: Entries = {}
    for part in [wanted] if only else parts_of(corpus):
        _, _, name = part.partition("/")
        found = module_of(corpus).collect(name) if name else module_of(corpus).collect()
        for entry, value in found.items() if isinstance(found, Mapping) else found:
            if entry in entries or not entry.startswith(name + "/" * bool(name)):
                raise ValueError(f"{corpus}: entry {entry} stands twice, or not in part {name}")
            entries[entry] = rounded(json.loads(json.dumps(value, allow_nan=False)))
    return entries


def rounded(value: Any) -> Any:
    """Return a JSON value with its numbers to `DIGITS` places."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def stored(corpus: str) -> Entries:
    """Return the entries that are stored; none if the corpus is new."""
    plain, packed = files_of(corpus)
    if packed.exists():
        return json.loads(gzip.decompress(packed.read_bytes()))
    return json.loads(plain.read_text(encoding="utf-8")) if plain.exists() else {}


def store(corpus: str, entries: Entries) -> Path:
    """Write a corpus, one entry a line in the order of their names; return the file."""
    lines = [
        f"{json.dumps(name)}: {json.dumps(entries[name], sort_keys=True)}"
        for name in sorted(entries)
    ]
    data = ("{\n" + ",\n".join(lines) + "\n}\n").encode()
    plain, packed = files_of(corpus)
    plain.parent.mkdir(exist_ok=True)
    file, other = (packed, plain) if len(data) > COMPRESSED_FROM else (plain, packed)
    other.unlink(missing_ok=True)
    file.write_bytes(gzip.compress(data, mtime=0) if file is packed else data)
    return file


def files_of(corpus: str) -> tuple[Path, Path]:
    """Return where a small and a large corpus are stored."""
    name = module_of(corpus).NAME
    return HERE / "data" / f"{name}.json", HERE / "data" / f"{name}.json.gz"


def differences(before: Any, after: Any, path: str = "") -> Iterator[str]:
    """Yield what differs between two JSON values, as "path: before -> after"."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted({*before, *after}):
            if key not in before or key not in after:
                yield f"{path}.{key}: " + ("new" if key in after else "gone")
            else:
                yield from differences(before[key], after[key], f"{path}.{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for number, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from differences(one, other, f"{path}[{number}]")
    elif not is_same(before, after):
        yield f"{path}: {short(before)} -> {short(after)}"


def is_same(before: Any, after: Any) -> bool:
    """Return whether two values that hold no others are alike: numbers nearly, others exactly."""
    if isinstance(before, float) or isinstance(after, float):
        numbers = all(type(one) in (int, float) for one in (before, after))
        return numbers and abs(before - after) <= max(
            ABSOLUTE, RELATIVE * max(abs(before), abs(after))
        )
    return type(before) is type(after) and before == after


def short(value: Any) -> str:
    """Return a value as one short line."""
    text = json.dumps(value)
    return text if len(text) <= 160 else f"{text[:110]} ... {text[-40:]}"


def compare(before: Entries, after: Entries) -> tuple[Entries, list[str]]:
    """Return the entries to store, old ones where nothing changed, and lines on what did."""
    new = [name for name in sorted(after) if name not in before]
    gone = [name for name in sorted(before) if name not in after]
    both = [name for name in sorted(after) if name in before]
    apart = {name: list(differences(before[name], after[name])) for name in both}
    changed = {name: unlike for name, unlike in apart.items() if unlike}
    lines = []
    for said, names in (("new", new), ("gone", gone), ("changed", list(changed))):
        if names:
            lines.append(f"  {len(names)} {said}")
        for name in names[:SHOWN]:
            value = after[name] if said == "new" else before[name]
            lines.append(f"    {name}" + (f": {short(value)}" if said != "changed" else ""))
            unlike = changed.get(name, [])
            lines += [f"      {one}" for one in unlike[:SHOWN]]
            if len(unlike) > SHOWN:
                lines.append(f"      and {len(unlike) - SHOWN} more values")
        if len(names) > SHOWN:
            lines.append(f"    and {len(names) - SHOWN} more")
    kept = {name: after[name] if name in changed or name in new else before[name] for name in after}
    return kept, lines


def make(wanted: str, *, check: bool) -> bool:
    """Make CORPUS or CORPUS/PART, compare, store unless only checked; return if all is alike."""
    corpus, _, part = wanted.partition("/")
    start = time.monotonic(), cpu_s()
    everything = stored(corpus)
    before = {k: v for k, v in everything.items() if k.startswith(part + "/" * bool(part))}
    kept, lines = compare(before, collect(wanted))
    wall, cpu = time.monotonic() - start[0], cpu_s() - start[1]
    verdict = "as stored" if not lines else "differs:" if check else "changed:"
    print(f"{wanted}: {len(kept)} entries, {wall:.0f} s, {cpu:.0f} s of CPU, {verdict}")
    print(*lines, sep="\n", end="\n" if lines else "", flush=True)
    if lines and not check:
        others = {k: v for k, v in everything.items() if k not in before}
        print(f"  stored in {store(corpus, others | kept).relative_to(ROOT)}", flush=True)
    return not lines


def cpu_s() -> float:
    """Return the CPU seconds of this process and of those that it started."""
    processes = (psutil.Process(), *psutil.Process().children())
    return sum(sum(process.cpu_times()[:4]) for process in processes)


def main() -> int:
    """Make or check the corpora that are named; exit code 1 if a check found a difference."""
    if any(os.environ.get(name) != value for name, value in ENVIRONMENT.items()) or any(
        name in os.environ for name in UNSET
    ):
        kept = {name: value for name, value in os.environ.items() if name not in UNSET}
        arguments = [sys.executable, str(HERE / "make.py"), *sys.argv[1:]]
        os.execve(sys.executable, arguments, kept | ENVIRONMENT)
    sys.path = [str(ROOT), str(HERE.parent), *(one for one in sys.path if one != str(HERE))]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="CORPUS or CORPUS/PART; all")
    parser.add_argument("--check", action="store_true", help="store nothing, exit 1 on a change")
    asked = parser.parse_args()
    names = asked.names or list(CORPORA)
    for name in names:
        if name.partition("/")[0] not in CORPORA:
            parser.error(f"no corpus {name}; there are {', '.join(CORPORA)}")
        if "/" in name and name not in parts_of(name.partition("/")[0]):
            parser.error(f"no part {name}; parts: {', '.join(parts_of(name.partition('/')[0]))}")
    alike = [make(name, check=asked.check) for name in names]
    return int(asked.check and not all(alike))


if __name__ == "__main__":
    raise SystemExit(main())
