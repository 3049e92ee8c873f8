"""The compiled kernels against their numpy form: the same touches read by both, answer by answer.

    python tests/campaigns/compiled.py draw --database lab.db --touches 10000 -o touches.npz
    python tests/campaigns/compiled.py read touches.npz --kernels numpy -o numpy.jsonl
    python tests/campaigns/compiled.py read touches.npz --kernels compiled -o compiled.jsonl
    python tests/campaigns/compiled.py compare numpy.jsonl compiled.jsonl

Touches of all kinds and levels, drawn as `validate-set` draws them; a run that was stopped goes on
where it ended. CPU is that of reading, one core.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections import Counter
from itertools import cycle, islice
from pathlib import Path

for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")

import numpy as np  # noqa: E402

from encoded_objects.base.compiled import CHOICE  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.symbols.kernels import kernels_in_use  # noqa: E402
from recognizer.validation.draw import draw_touch  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan, sensor_of  # noqa: E402

#: Every twentieth touch is the first of these, and so on.
KINDS = (
    *("face", "edge", "face", "corner", "face", "worn", "edge", "side", "face", "blank"),
    *("face", "edge", "corner", "ridges", "worn", "dots", "rough", "random symbols"),
    *("other lab", "text"),
)
LEVELS = ("typical", "mismatch", "low", "hard")
NEAR_MM = 1e-6  # by which poses of one touch may differ


def draw(options: argparse.Namespace) -> None:
    reader = Reader(open_lab(options.database), sensor_of("", options.overlay))
    kinds = list(islice(cycle(KINDS), options.touches))
    counts = []
    for number, kind in enumerate(kinds):
        level = LEVELS[number // len(KINDS) % len(LEVELS)]
        plan = TouchPlan(options.database, options.seed, level, kind)
        counts.append(draw_touch(plan, number, reader).counts)
    given = {"database": options.database, "overlay": options.overlay}
    np.savez_compressed(options.output, counts=counts, kinds=kinds, **given)


def read(options: argparse.Namespace) -> None:
    os.environ[CHOICE] = options.kernels
    if kernels_in_use() != options.kernels:
        raise SystemExit(f"{options.kernels} kernels are not here: pip install -e .")
    touches = np.load(options.touches)
    reader = Reader(open_lab(str(touches["database"])), sensor_of("", str(touches["overlay"])))
    reader.read(touches["counts"][0])  # the window index is made by the first touch
    found = Path(options.output)
    known = len(found.read_text().splitlines()) if found.exists() else 0
    with found.open("a", encoding="utf-8") as lines:
        for number in range(known, len(touches["kinds"])):
            start = time.process_time()
            answer = reader.read(touches["counts"][number], seq=number)
            ms = 1e3 * (time.process_time() - start)
            line = {"kind": str(touches["kinds"][number]), "ms": ms, **answer.as_json()}
            lines.write(json.dumps(line) + "\n")
            lines.flush()


def compare(options: argparse.Namespace) -> int:
    one, other = (
        [json.loads(line) for line in Path(file).read_text().splitlines()]
        for file in (options.one, options.other)
    )
    count, unlike, farthest = Counter(), [], 0.0
    for a, b in zip(one, other, strict=False):
        count[a["kind"]] += 1
        names = ("object", "face", "index", "reason")
        away = 0.0
        if a["T_face_probe"] and b["T_face_probe"]:
            poses = (np.array(each["T_face_probe"]) for each in (a, b))
            away = float(np.abs(np.subtract(*poses)).max())
        farthest = max(farthest, away)
        if any(a[name] != b[name] for name in names) or away > NEAR_MM:
            unlike.append((a, b, away))
    print(f"{sum(count.values())} touches, {len(unlike)} unlike, poses within {farthest:.1e} mm")
    for a, b, away in unlike[:20]:
        said = (f"{each['object']}/{each['face']} {each['reason']}" for each in (a, b))
        print(f"  {a['seq']:6d} {a['kind']:15s} {' | '.join(said)} {away:.1e} mm")
    print(f"{'kind':16s} {'touches':>7s} {'ms':>8s} {'ms':>8s}")
    for kind in count:
        ms = [np.median([x["ms"] for x in each if x["kind"] == kind]) for each in (one, other)]
        print(f"{kind:16s} {count[kind]:7d} {ms[0]:8.2f} {ms[1]:8.2f}")
    return 1 if unlike else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    drawing = commands.add_parser("draw")
    drawing.add_argument("--database", required=True)
    drawing.add_argument("--touches", type=int, default=10000)
    drawing.add_argument("--seed", type=int, default=20)
    drawing.add_argument("--overlay", default="tab")
    drawing.add_argument("-o", dest="output", required=True)
    drawing.set_defaults(run=draw)
    reading = commands.add_parser("read")
    reading.add_argument("touches")
    reading.add_argument("--kernels", choices=("numpy", "compiled"), required=True)
    reading.add_argument("-o", dest="output", required=True)
    reading.set_defaults(run=read)
    comparing = commands.add_parser("compare")
    comparing.add_argument("one")
    comparing.add_argument("other")
    comparing.set_defaults(run=compare)
    options = parser.parse_args()
    raise SystemExit(options.run(options))


if __name__ == "__main__":
    main()
