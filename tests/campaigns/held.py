"""Hold `open-bench` in every way that a page can think of, and see how it ends.

    python tests/campaigns/held.py [--only making sockets] [--seconds 4]

Each load is put on a server of its own (loopback, bounded in number and time); while it lasts, the
server's memory and CPU, and how long it takes to answer a request for the time. Then SIGTERM or
SIGINT: seconds to end, exit code, processes and files that are left. Exit code 1 where a server
takes longer than `ENDED_S`, ends with another code than 0, or leaves something.
"""

import json
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import runner

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_loads import LOADS, LONG, held
from hostile_recordings import write_zeros

ENDED_S = 2.0  #: after a signal


def prepare(root: Path) -> None:
    """Make the lab with a cube and a recording that is long to read."""
    (root / "cube.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\n")
    made = runner.command("generator", "cube.yaml", "--format", "stl")
    subprocess.run(made, cwd=root, check=True, capture_output=True)
    write_zeros(root / "long.h5", LONG)


def main() -> int:
    asked = runner.asked(__doc__, only=[""], seconds=4.0)
    names = [name for name in LOADS if asked.only == [""] or name in asked.only]
    wrong = 0
    heads = ("load", "signal", "MB", "CPU", "answer, s", "end, s", "code", "left", "tracebacks")
    runner.table(heads)
    with tempfile.TemporaryDirectory() as root:
        prepare(Path(root))
        for name in names:
            for number in (signal.SIGTERM, signal.SIGINT):
                one = held(Path(root), name, number, asked.seconds)
                left = f"{one['processes']} processes, {one['files']} files"
                runner.row(name, one["signal"], one["memory_mb"], one["cpu"], one["answered_s"],
                           one["ended_s"], one["code"], left, one["tracebacks"])  # fmt: skip
                sound = one["ended_s"] <= ENDED_S and one["code"] == 0  # type: ignore[operator]
                wrong += not (sound and not one["processes"] and not one["files"])
                sys.stderr.write(json.dumps(one) + "\n")
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
