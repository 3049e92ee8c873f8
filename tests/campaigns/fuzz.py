"""Feed damaged files, packets and requests to their readers, and count what becomes of them.

    python tests/campaigns/fuzz.py [--kinds recording mcap ...] [--minutes 10] [--cases 20000]
                                   [--seed 1] -o DIR

The kinds and the damage are those of `tests/foreign`; without `--kinds` all of them, each for
so many minutes or cases, whichever ends first. Cases run in a forked worker of their own, with 5 s
and 512 MB each; a worker that dies or hangs is replaced. `DIR/KIND.jsonl` holds a row a batch, so a
campaign goes on where it was, and what was found: each fault with the numbers of its cases, which
`--show KIND NUMBER` runs again in the foreground. Exit code 1 if there is any fault.
"""

import json
import os
import select
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import foreign
import runner
from foreign.case import FAULTS, READ, REFUSED, scratch

BATCH = 250  #: cases of a worker
LATE_S = 60.0  #: after which a worker without a word is killed
LISTED = 5  #: cases of a fault that are kept by number
HEADS = ("kind", "cases", READ, REFUSED, *FAULTS, "ms a case", "MB")


def worker(kind: str, first: int, last: int, root: Path, out: int) -> None:
    """Run cases; a line each: what, detail, seconds, megabytes. Never returns."""
    code = 1
    try:
        for number in range(first, last):
            outcome = foreign.attempt(kind, number, root)
            words = (outcome.what, outcome.detail, outcome.seconds, outcome.megabytes)
            os.write(out, json.dumps(words).encode() + b"\n")
        code = 0
    except BaseException:  # noqa: BLE001  (the child ends here, whatever it was)
        traceback.print_exc()
    finally:
        os._exit(code)


def lines(kind: str, first: int, last: int, root: Path) -> Any:
    """Yield the outcomes of cases, that of the one that kills its worker too."""
    at = first
    while at < last:
        end, out = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(end)
            worker(kind, at, last, root, out)
        os.close(out)
        text, late = b"", False
        while not late:
            late = not select.select([end], [], [], LATE_S)[0]
            came = b"" if late else os.read(end, 65536)
            *whole, text = (text + came).split(b"\n")
            for line in whole:
                at += 1
                yield json.loads(line)
            if not came:
                break
        os.close(end)
        if late:
            os.kill(child, signal.SIGKILL)
        status = os.waitpid(child, 0)[1]
        if at < last:
            what = "hang" if late else "died"
            yield what, f"case {at}: status {status}", LATE_S * late, 0.0
            at += 1


def campaign(kind: str, asked: Any) -> list[dict[str, Any]]:
    """Run a kind until its time or its cases are over; returns its rows."""
    file = asked.output / f"{kind.replace(' ', '-')}.jsonl"
    file.touch()
    rows = [json.loads(line) for line in file.read_text("utf-8").splitlines()]
    end_s = time.monotonic() + 60 * asked.minutes - sum(row["seconds"] for row in rows)
    done = sum(row["cases"] for row in rows)
    with (
        tempfile.TemporaryDirectory(prefix="fuzz-", dir=scratch()) as folder,
        file.open("a") as out,
    ):
        if done < asked.cases:
            foreign.prepare(kind, Path(folder))
        while done < asked.cases and time.monotonic() < end_s:
            start, cases = time.monotonic(), min(BATCH, asked.cases - done)
            first = asked.seed * 10**9 + done
            counts, most, found = Counter[str](), 0.0, {}
            for number, (what, detail, _, megabytes) in enumerate(
                lines(kind, first, first + cases, Path(folder)), first
            ):
                counts[what] += 1
                most = max(most, megabytes)
                if what in FAULTS:
                    found.setdefault(f"{what}: {detail}", []).append(number)
            row = {"cases": cases, "counts": counts, "megabytes": most, "found": found,
                   "seconds": time.monotonic() - start}  # fmt: skip
            rows.append(row)
            out.write(json.dumps(row) + "\n")
            out.flush()
            done += cases
    return rows


def main() -> int:
    """Run as the options say; print a table, then each fault with cases that show it."""
    asked = runner.asked(__doc__, output=True, kinds=[""], minutes=10.0, cases=10**9, seed=1,
                         show=[""])  # fmt: skip
    asked.output.mkdir(parents=True, exist_ok=True)
    if asked.show != [""]:
        *kind, number = asked.show
        print(foreign.attempt(" ".join(kind), int(number), asked.output / "case"))
        return 0
    kinds = [kind for kind in asked.kinds if kind] or list(foreign.KINDS)
    found: dict[str, list[int]] = {}
    runner.table(HEADS)
    for kind in kinds:
        rows = campaign(kind, asked)
        counts = sum((Counter(row["counts"]) for row in rows), Counter[str]())
        cases, seconds = sum(row["cases"] for row in rows), sum(row["seconds"] for row in rows)
        for row in rows:
            for what, numbers in row["found"].items():
                found.setdefault(f"{kind}: {what}", []).extend(numbers)
        runner.row(
            kind, cases, *(counts[what] for what in HEADS[2:-2]), 1e3 * seconds / max(cases, 1),
            max((row["megabytes"] for row in rows), default=0.0),
        )  # fmt: skip
    for what, numbers in sorted(found.items()):
        print(f"{len(numbers):6d}  {what}  {' '.join(map(str, numbers[:LISTED]))}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
