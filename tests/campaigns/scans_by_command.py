"""Scans of the profiles that one touch cannot read, by the commands that people use.

    python tests/campaigns/scans_by_command.py FOLDER --profile thesis --scans 20 --seed 1

Encodes an 80 mm cube in the profile (symbols of 15 mm for `product`, which holds six faces then),
simulates so many scans of 20 touches each of one of its faces, as an arm with play believes them
(`probe-sensor simulate --scan kinesthetic`), and reads each by `recognize-object --scan --json`.
Prints how many name the face at their end and at which touch the first answer came; exit code 1
if any answer of any scan is wrong.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

SPEC = "name: Cube\nshape: {{cube: 80 mm}}\nprofile: {profile}\n{symbols}"
SYMBOLS = {"product": "symbols: {pitch: 15 mm}\n"}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--profile", choices=("thesis", "product"), default="thesis")
    parser.add_argument("--scans", type=int, default=20)
    parser.add_argument("--touches", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    database = folder / "lab.db"
    if not database.exists():
        spec = folder / "cube.yaml"
        symbols = SYMBOLS.get(options.profile, "")
        spec.write_text(SPEC.format(profile=options.profile, symbols=symbols))
        run("encode-object", spec, "-o", folder / "parts", "--format", "stl",
            "--database", f"sqlite:///{database}")  # fmt: skip
    right = wrong = 0
    for seed in range(options.seed, options.seed + options.scans):
        face, recording = f"F{seed % 6 + 1}", folder / f"scan-{seed}.h5"
        run("probe-sensor", "simulate", f"{database}#Cube/{face}", "--scan", "kinesthetic",
            "--touches", options.touches, "--seed", seed, "-o", recording, "--replace")  # fmt: skip
        told = json.loads(run("recognize-object", recording, "--database", database,
                              "--scan", "--json"))  # fmt: skip
        named = [one["face"] for one in told]
        wrong += any(name not in (None, face) for name in named)
        right += named[-1] == face
        first = next((k + 1 for k, name in enumerate(named) if name), None)
        print(f"seed {seed}, {face}: {named[-1]}, first answer at touch {first}", flush=True)
    print(f"{options.profile}: {right} of {options.scans} scans right, {wrong} with a wrong answer")
    return 1 if wrong else 0


def run(*words: object) -> str:
    """Run a command; 1 is what `recognize-object` ends with when it does not recognise."""
    found = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if found.returncode not in (0, 1) or not found.stdout:
        sys.exit(f"{words[0]}: {found.stderr}")
    return found.stdout


if __name__ == "__main__":
    sys.exit(main())
