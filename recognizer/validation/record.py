"""What the folder of a run remembers of it, so that it can go on as it began.

`asked.json` <-> RunRecord: what decides the results, and where the set is. A database that
is a file is named from the folder, so that both can be moved together.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from generator.database.open import normal_url
from recognizer.validation.campaign import PRINTED, Campaign
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import write_json
from recognizer.validation.made_kinds import labs_of
from recognizer.validation.work import Work, code_digest

RECORD = "asked.json"
PRINTS = "printed.json"  #: which surface of the folder of prints is which face
FORMAT = 2  #: of the record; another one is refused


@dataclass(frozen=True, slots=True)
class RunRecord:
    """A run as its folder remembers it."""

    campaign: Campaign
    database: str  #: a SQLite file from the folder of the run, or a URL
    set_digest: str
    code_digest: str
    specs: tuple[str, ...] = ()  #: as they were named

    def work(self, folder: Path) -> Work:
        """Return what the workers get."""
        url = absolute_database(self.database, folder)
        labs = labs_of(folder, [kind for kind, _ in self.campaign.kinds])
        prints = str(folder.absolute() / PRINTS) if self.campaign.surfaces == PRINTED else ""
        return Work(self.campaign, url, self.set_digest, self.code_digest, labs, prints)

    def work_now(self, folder: Path) -> Work:
        """Return the same for this version, which may be another than that of the touches."""
        return replace(self.work(folder), code_digest=code_digest())


def read_record(folder: Path) -> RunRecord:
    """Return the record of a folder's run.

    Raises
    ------
    ValidationError
        The folder holds no run, or one of another version.
    """
    path = folder / RECORD
    try:
        values = json.loads(path.read_text("utf-8"))
        if values["format"] != FORMAT:
            raise ValidationError(
                f"a run of format {values['format']}, this version reads {FORMAT}",
                fix="start anew in another folder",
                place=str(path),
            )
        given = values["campaign"]
        for name in ("kinds", "levels"):
            given[name] = tuple((key, float(share)) for key, share in given[name])
        return RunRecord(
            campaign=Campaign(**given),
            database=values["database"],
            set_digest=values["set"],
            code_digest=values["code"],
            specs=tuple(values["specs"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValidationError(
            "no run of validate-set", fix="name the folder that -o named", place=str(folder)
        ) from error


def write_record(record: RunRecord, folder: Path) -> None:
    """Remember a run."""
    values = {
        "format": FORMAT,
        "campaign": asdict(record.campaign),
        "database": record.database,
        "set": record.set_digest,
        "code": record.code_digest,
        "specs": list(record.specs),
    }
    write_json(folder / RECORD, values)


def check_same(before: RunRecord, now: RunRecord, folder: Path) -> None:
    """See to it that a run goes on as it began.

    Raises
    ------
    ValidationError
        Options, specs, the set or this software have changed.
    """
    old, new = asdict(before.campaign), asdict(now.campaign)
    differ = [f"{name} {old[name]}, now {new[name]}" for name in new if old[name] != new[name]]
    if before.specs != now.specs:
        differ.append(f"specs {', '.join(before.specs)}, now {', '.join(now.specs)}")
    if before.set_digest != now.set_digest:
        differ.append("another set")
    if before.code_digest != now.code_digest:
        differ.append("another version of this software")
    if differ:
        raise ValidationError(
            f"the run began otherwise: {'; '.join(differ)}",
            fix="give the same options, or start anew in another folder with -o",
            place=str(folder),
        )


def absolute_database(database: str, folder: Path) -> str:
    """Return where the database of a record is."""
    if "://" in database:
        return database
    return str(Path(os.path.normpath(folder.absolute() / database)))


def relative_database(database: str, folder: Path) -> str:
    """Return how a record names a database: a file from the folder, a server by its URL."""
    url = normal_url(database)
    if url.get_backend_name() != "sqlite" or url.database is None:
        return database
    return Path(os.path.relpath(Path(url.database).absolute(), folder.absolute())).as_posix()
