"""Labs made apart, each with a key of its own, merged into the first one.

    python tests/campaigns/lab_merge.py [--labs 20] [--objects 10] [--profile one-touch]

Prints how many objects came over and how many were refused, how many arrays the merged database
holds, and whether every cell shows what its array says. Exit code 1 if an object is refused.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from generator.array import array_from
from generator.array.lab_key import lab_key_of
from generator.database.exchange import import_objects
from generator.database.lab import lab_key
from generator.database.open import open_database
from generator.database.read import list_objects, read_array, read_object
from generator.database.transaction import read_transaction
from generator.pipeline import encode
from generator.spec import read_specs
from generator.spec.read import tree_from

BLOCK = {"box": ["45 mm", "35 mm", "28 mm"]}


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--labs", type=int, default=20)
    options.add_argument("--objects", type=int, default=10)
    options.add_argument("--profile", default="one-touch")
    options.add_argument("--seed", type=int, default=1)
    asked = options.parse_args()
    rng = np.random.default_rng(asked.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        labs = [f"sqlite:///{folder / f'{k}.db'}" for k in range(asked.labs)]
        for k, url in enumerate(labs):
            spec = {"name": f"Lab {k} brick", "shape": BLOCK, "profile": asked.profile}
            tree = tree_from(spec | {"copies": asked.objects})
            encode(
                read_specs([tree]), folder=folder / str(k), database=url, formats=(),
                lab_key=lab_key_of(rng.bytes(16)), jobs=1,
            )  # fmt: skip
            print(f"lab {k + 1} of {asked.labs}", end="\r", file=sys.stderr)
        done = [import_objects(labs[0], url, skip_refused=True) for url in labs[1:]]
        refused = sum(len(one.refused) for one in done)
        with read_transaction(open_database(labs[0])) as connection:
            entries = list_objects(connection)
            numbers = {entry.array_id for entry in entries}
            arrays = {n: array_from(read_array(connection, n).definition) for n in numbers}
            wrong = 0
            for entry in entries:
                for face in read_object(connection, entry.name).layout.faces:
                    shown = arrays[entry.array_id].symbols(face.rows, face.columns)
                    wrong += int((shown != face.labels).sum())
            key = lab_key(connection)
    print(f"{asked.profile}: {asked.labs} labs of {asked.objects} objects, merged into lab {key}")
    print(f"came over {sum(len(one.copied) for one in done)}, refused {refused}")
    print(f"objects {len(entries)}, arrays {len(numbers)}, cells that show another symbol {wrong}")
    return 1 if refused or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
