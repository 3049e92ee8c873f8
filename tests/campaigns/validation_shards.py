"""Whether two runs of `validate-set` wrote the same shards; used by the campaigns beside this."""

from __future__ import annotations

from pathlib import Path

SHARDS = "shards/touches/*.parquet"


def shards(folder: Path) -> list[Path]:
    """Return the shards of a run that are written, in order."""
    return sorted(folder.glob(SHARDS))


def differing(made: Path, like: Path, *also: str) -> list[str]:
    """Return the names of shards, and of other files, that another run has otherwise.

    Shards of a run of more touches may be compared; what stands for a whole run may not.
    """
    return [
        path.name
        for path in [*shards(made), *(made / name for name in also)]
        if path.read_bytes() != (like / path.relative_to(made)).read_bytes()
    ]
