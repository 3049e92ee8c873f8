"""What a campaign is: how many touches, of which kinds and levels, and how each is drawn.

Campaign + number -> TouchPlan. Kind and level of a touch come from its number alone, as the
touch itself does (`draw`), so that no way of sharing the work can change a result. A campaign
has several series: the touches, and for the picture of error against run time a few touches
again by readers that spend more or less.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from itertools import accumulate
from typing import Any

import numpy as np

from encoded_objects.base.number import needed_number
from encoded_objects.base.sensor_type import (
    USUAL_SENSOR,
    SensorType,
    choose_sensor_type,
    sensor_type_text,
)
from probe.contact.engines import ENGINES, engine_named
from probe.simulate.world.levels import LEVELS
from recognizer.touch.options import DEFAULTS
from recognizer.touch.reader import Reader
from recognizer.validation.draw import FOREIGN
from recognizer.validation.encoded_set import COPY, DECOY, DECOYS, NEAR, SAME_PROFILE, SIDE, SMALL
from recognizer.validation.errors import ValidationError
from recognizer.validation.touch_plan import ROW, TouchPlan
from recognizer.validation.trial import ONE, POLICY_NAMES

SHARD = 1000  #: touches in a file, lost at most with a run
BATCH = 25  #: touches that a worker takes at once, 1/8 s: calls cost nothing then
#: Touches of faces that every reader of a study gets: the interval of 99.5 % is then 2 % wide. Six
#: readers take 1,200, so a run of fewer touches than this has no study unless it is named.
STUDY = 200

TOUCHES = "touches"  #: name of the series that is counted
BLANK, STRANGE = "blank", "foreign"
ON_FACES = ("face", ROW, "edge", "corner", "worn", COPY, NEAR, SMALL, SIDE)
#: What is touched: the written STL files, what a printer leaves of them, the registered faces.
FILES, PRINTED, REGISTERED = SURFACES = ("files", "printed", "database")

Shares = tuple[tuple[str, float], ...]

#: Kinds of touches and their shares. `foreign` is any of `draw.FOREIGN` but the blank one.
KINDS: Shares = (
    ("face", 0.55),
    ("edge", 0.10),
    ("corner", 0.05),
    ("worn", 0.10),
    (BLANK, 0.05),
    (STRANGE, 0.15),
)
KIND_NAMES = (*ON_FACES, BLANK, STRANGE, SAME_PROFILE, DECOY)  #: all that `--kinds` names
LEVEL_SHARES: Shares = (("low", 0.1), ("typical", 0.4), ("hard", 0.2), ("mismatch", 0.3))

#: Readers of the picture of error against run time: candidates, steps, finalists, final steps.
READERS: dict[str, tuple[int, int, int, int]] = {
    "least": (1, 1, 1, 1),
    "one lattice": (1, 2, 1, 2),
    "more steps": (3, 3, 2, 4),
    "more candidates": (12, 4, 4, 6),
    "most": (24, 6, 8, 10),
}
#: Classes of touches whose limits are shown: kind, and levels other than the campaign's.
LIMIT_CLASSES: dict[str, tuple[str, Shares]] = {
    "face": ("face", ()),
    "edge": ("edge", ()),
    "corner": ("corner", ()),
    "light": ("face", (("light", 1.0),)),
}
EFFORT = ("candidates", "steps", "finalists", "final_steps")  #: options of a reader
AS_IS = "as it is"  #: the reader with the settings that it has


@dataclass(frozen=True, slots=True)
class Campaign:
    """Everything that decides the results, but for the set itself."""

    touches: int = 1000
    seed: int = 1
    kinds: Shares = KINDS
    levels: Shares = LEVEL_SHARES
    sensor_type: SensorType = USUAL_SENSOR
    overlay: str = "tab"
    surfaces: str = FILES  #: what is touched: `SURFACES`
    print_profile: str = ""  #: of printed surfaces: machine, nozzle, layers
    faults: str = ""  #: of printed surfaces: what the machine does wrong
    engine: str = "own"  #: of contact
    sensor_per: str = "touch"  #: or `run`: how long the errors of a sensor stay the same
    policy: str = ONE  #: or `next`: touches follow until one is answered
    study: int = 0  #: touches of every reader of `READERS`; 0: no study
    limits: int = 0  #: touches of every class of `LIMIT_CLASSES`; 0: no limit is shown
    shard: int = SHARD  #: touches in a file: at most so many are lost with a run

    @property
    def sensor(self) -> SensorType:
        """The sensor type under the overlay of the campaign."""
        return self.sensor_type.with_overlay(self.overlay)

    @property
    def kind_names(self) -> list[str]:
        """Kinds that are touched."""
        return [kind for kind, _ in self.kinds]

    def as_json(self) -> dict[str, Any]:
        """Return the fields; the sensor type as YAML, empty for `fsr-16`."""
        usual = self.sensor_type == USUAL_SENSOR
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return values | {"sensor_type": "" if usual else sensor_type_text(self.sensor_type)}


def campaign_from(values: Mapping[str, Any]) -> Campaign:
    """Return a campaign from the values of `as_json`, read from a file."""
    shares = {
        name: tuple((key, float(share)) for key, share in values[name])
        for name in ("kinds", "levels")
    }
    kind = choose_sensor_type(None, values["sensor_type"], None, "--sensor-type")
    return Campaign(**{**values, **shares, "sensor_type": kind})


def campaign_of(options: Mapping[str, Any], known: Campaign | None) -> Campaign:
    """Return the campaign of options, over that of the run that is resumed, over defaults.

    Parameters
    ----------
    options
        Fields of the campaign as they were given, `kinds` and `levels` as text; None or empty: not
        given.
    known
        Of the run that is resumed.

    Raises
    ------
    ValidationError
        An option is unknown, or does not suit another one.
    """
    given = {name: value for name, value in options.items() if value is not None and value != ""}
    for name, allowed in {
        "overlay": ("tab", "pad"),
        "surfaces": SURFACES,
        "engine": tuple(ENGINES),
        "sensor_per": ("touch", "run"),
        "policy": POLICY_NAMES,
    }.items():
        if name in given and given[name] not in allowed:
            raise ValidationError(
                f"'{given[name]}' is not known",
                fix=f"give {' or '.join(allowed)}",
                place=f"--{name.replace('_', '-')}",
            )
    for name, least in {"touches": 1, "seed": 0, "study": 0, "limits": 0, "shard": 1}.items():
        if name in given and (fix := needed_number(given[name], whole=True, least=least)):
            raise ValidationError(repr(given[name]), fix=fix, place=f"--{name}")
    named = "kinds" in given
    for name, names in (("kinds", KIND_NAMES), ("levels", tuple(LEVELS))):
        if name in given:
            given[name] = shares_of(given[name], names, f"--{name}")
    if "sensor_type" in given:
        given.setdefault("overlay", given["sensor_type"].overlay.kind)
    if known is None:
        touches = given.get("touches", Campaign().touches)
        given.setdefault("study", STUDY if touches >= STUDY else 0)
    campaign = replace(known or Campaign(), **given)
    for name in ("print_profile", "faults"):
        if getattr(campaign, name) and campaign.surfaces != PRINTED:
            raise ValidationError(
                f"{campaign.surfaces} are touched, nothing is printed",
                fix="add --surfaces printed",
                place=f"--{name.replace('_', '-')}",
            )
    return _touchable(campaign, named)


def _touchable(campaign: Campaign, named: bool) -> Campaign:
    """Return a campaign without the kinds that it cannot touch: prints are of parts of the set.

    Refuses them if a person named the kinds (`named`), and an overlay that the engine does not
    know.
    """
    overlays = engine_named(campaign.engine).overlays
    if campaign.overlay not in overlays:
        raise ValidationError(
            f"engine {campaign.engine} does not know the overlay {campaign.overlay}",
            fix=f"take --overlay {' or '.join(overlays)}, or --engine own",
            place="--engine",
        )
    if campaign.surfaces != PRINTED:
        return campaign
    other = [kind for kind in campaign.kind_names if kind not in ON_FACES]
    if named and other:
        raise ValidationError(
            f"prints are parts of the set, not {', '.join(other)}",
            fix=f"name kinds among {', '.join(ON_FACES)}, or take --surfaces files",
            place="--kinds",
        )
    kept = [(kind, share) for kind, share in campaign.kinds if kind in ON_FACES]
    total = sum(share for _, share in kept)
    return replace(campaign, kinds=tuple((kind, share / total) for kind, share in kept))


def shares_of(text: str, allowed: tuple[str, ...], option: str) -> Shares:
    """Read `face=2,edge` from an option: names with their weights, 1 where none is given.

    Raises ValidationError: for a name that is not allowed, or weights that are no shares.
    """
    found: dict[str, float] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, _, weight = (part.strip() for part in item.partition("="))
        if name not in allowed or name in found:
            what = "stands twice" if name in found else "is not known"
            raise ValidationError(
                f"'{name}' {what}", fix=f"allowed are {', '.join(allowed)}", place=option
            )
        try:
            found[name] = float(weight) if weight else 1.0
        except ValueError:
            found[name] = math.nan
        if not 0 <= found[name] < math.inf:
            raise ValidationError(
                f"the share of {name} is '{weight}'", fix="give 0 or more", place=option
            )
    total = sum(found.values())
    if not total > 0:
        raise ValidationError("nothing is left to draw", fix="give one share above 0", place=option)
    return tuple((name, value / total) for name, value in found.items() if value > 0)


@dataclass(frozen=True, slots=True)
class Series:
    """Numbers 0 ... touches - 1, drawn from shares and read by one reader."""

    name: str
    touches: int
    kinds: Shares
    levels: Shares
    shard: int
    reader: str = AS_IS
    limits: str = ""  #: of `LIMIT_CLASSES`, the class whose limits it shows; empty: none

    @property
    def shards(self) -> int:
        """Into how many files it goes."""
        return math.ceil(self.touches / self.shard)

    def batches(self, shard: int) -> Iterator[Batch]:
        """Yield the batches of a shard."""
        end = min((shard + 1) * self.shard, self.touches)
        for first in range(shard * self.shard, end, BATCH):
            yield Batch(self.name, first, min(first + BATCH, end))


@dataclass(frozen=True, slots=True, order=True)
class Batch:
    """Touches first ... last - 1 of a series."""

    series: str
    first: int
    last: int


def series_of(campaign: Campaign) -> tuple[Series, ...]:
    """Return the touches, and the series of the study if there is one."""
    levels, shard = campaign.levels, campaign.shard
    found = [Series(TOUCHES, campaign.touches, campaign.kinds, levels, shard)]
    for name in (AS_IS, *READERS) if campaign.study else ():
        label = f"reader-{name.replace(' ', '-')}"
        found.append(Series(label, campaign.study, (("face", 1.0),), levels, shard, name))
    for name, (kind, own) in LIMIT_CLASSES.items() if campaign.limits else ():
        label, kinds = f"limits-{name}", ((kind, 1.0),)
        found.append(Series(label, campaign.limits, kinds, own or levels, shard, limits=name))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Work:
    """A campaign on a set: what all batches of a run share."""

    campaign: Campaign
    database: str  #: as the workers find it, as all paths
    set_digest: str = ""
    code_digest: str = ""
    labs: tuple[str, ...] = ()  #: databases of other labs
    prints: str = ""  #: listing of the printed surfaces; empty: none
    specs: tuple[str, ...] = ()  #: as they were named

    def plan(self, series: Series, number: int) -> TouchPlan:
        """Return the plan that draws a touch."""
        campaign = self.campaign
        rng = np.random.default_rng([campaign.seed, number, 1])
        kind, level = _draw(series.kinds, rng), _draw(series.levels, rng)
        surface = kind
        if kind in (STRANGE, DECOY):
            strange = [name for name in FOREIGN if name != BLANK] if kind == STRANGE else DECOYS
            surface = strange[int(rng.integers(len(strange)))]
        return TouchPlan(
            self.database,
            campaign.seed,
            level,
            surface,
            kind,
            files=campaign.surfaces == FILES,
            prints=self.prints,
            engine=campaign.engine,
            sensor_per=campaign.sensor_per,
            labs=self.labs,
            policy=campaign.policy if series.name == TOUCHES else ONE,
        )


def _draw(shares: Shares, rng: np.random.Generator) -> str:
    ends = tuple(accumulate(share for _, share in shares))
    place = bisect_right(ends, rng.random() * ends[-1])
    return shares[min(place, len(shares) - 1)][0]


def reader_with(reader: Reader, name: str) -> Reader:
    """Return a reader that spends as `READERS` says, and no second try beyond it."""
    if name == AS_IS:
        return reader
    spent = replace(reader.options.first, **dict(zip(EFFORT, READERS[name], strict=True)))
    return replace(reader, options=replace(reader.options, first=spent, thorough=spent))


def settings_of(name: str) -> dict[str, int]:
    """Return what a reader of the study spends, as the report names it."""
    first = DEFAULTS.first
    values = READERS.get(name) or tuple(getattr(first, option) for option in EFFORT)
    named = {option.replace("_", " "): n for option, n in zip(EFFORT, values, strict=True)}
    return named | ({"second try": DEFAULTS.thorough.candidates} if name == AS_IS else {})
