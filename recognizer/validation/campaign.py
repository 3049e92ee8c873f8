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
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from probe.contact.engines import ENGINES, engine_named
from probe.simulate.world.levels import LEVELS
from recognizer.touch.options import DEFAULTS
from recognizer.touch.reader import Reader
from recognizer.validation.draw import FOREIGN
from recognizer.validation.encoded_set import COPY, NEAR, SAME_PROFILE, SIDE, SMALL
from recognizer.validation.errors import ValidationError
from recognizer.validation.touch_plan import TouchPlan, sensor_of
from recognizer.validation.trial import ONE, POLICY_NAMES

SHARD = 1000  #: touches in a file, lost at most with a run
BATCH = 25  #: touches that a worker takes at once, 1/8 s: calls cost nothing then
#: Touches of faces that every reader of a study gets: the interval of 99.5 % is then 2 % wide. Six
#: readers take 1,200, so a run of fewer touches than this has no study unless it is named.
STUDY = 200

TOUCHES = "touches"  #: name of the series that is counted
BLANK, STRANGE = "blank", "foreign"
ON_FACES = ("face", "edge", "corner", "worn", COPY, NEAR, SMALL, SIDE)
#: What is touched: the written STL files, what a printer leaves of them, the registered faces.
FILES, PRINTED, REGISTERED = SURFACES = ("files", "printed", "database")

Shares = tuple[tuple[str, float], ...]

#: Kinds of touches and their shares. `foreign` is any of `surfaces.FOREIGN` but the blank one.
KINDS: Shares = (
    ("face", 0.55),
    ("edge", 0.10),
    ("corner", 0.05),
    ("worn", 0.10),
    (BLANK, 0.05),
    (STRANGE, 0.15),
)
KIND_NAMES = (*ON_FACES, BLANK, STRANGE, SAME_PROFILE)  #: all that `--kinds` names
LEVEL_SHARES: Shares = (("low", 0.1), ("typical", 0.4), ("hard", 0.2), ("mismatch", 0.3))

#: Readers of the picture of error against run time: candidates, steps, finalists, final steps.
READERS: dict[str, tuple[int, int, int, int]] = {
    "least": (1, 1, 1, 1),
    "one lattice": (1, 2, 1, 2),
    "more steps": (3, 3, 2, 4),
    "more candidates": (12, 4, 4, 6),
    "most": (24, 6, 8, 10),
}
AS_IS = "as it is"  #: the reader with the settings that it has


@dataclass(frozen=True, slots=True)
class Campaign:
    """Everything that decides the results, but for the set itself."""

    touches: int = 1000
    seed: int = 1
    kinds: Shares = KINDS
    levels: Shares = LEVEL_SHARES
    sensor_type: str = ""  #: as YAML, `sensor_type_text`; empty: `fsr-16`
    overlay: str = "tab"
    surfaces: str = "files"  #: what is touched: `SURFACES`
    print_profile: str = ""  #: of printed surfaces: machine, nozzle, layers
    faults: str = ""  #: of printed surfaces: what the machine does wrong
    engine: str = "own"  #: of contact
    sensor_per: str = "touch"  #: or `run`: how long the errors of a sensor stay the same
    policy: str = ONE  #: or `next`: touches follow until one is answered
    study: int = 0  #: touches of every reader of `READERS`; 0: no study
    shard: int = SHARD  #: touches in a file: at most so many are lost with a run


def touchable(campaign: Campaign, named: bool) -> Campaign:
    """Return a campaign without the kinds that it cannot touch: prints are of parts of the set.

    Parameters
    ----------
    campaign
        As it was given.
    named
        Whether a person named the kinds; otherwise those that cannot be are left out.

    Raises
    ------
    ValidationError
        It asks for what cannot be touched so, or for an overlay that its engine does not know.
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
    other = [kind for kind, _ in campaign.kinds if kind not in ON_FACES]
    if named and other:
        raise ValidationError(
            f"prints are parts of the set, not {', '.join(other)}",
            fix=f"name kinds among {', '.join(ON_FACES)}, or take --surfaces files",
            place="--kinds",
        )
    kept = [(kind, share) for kind, share in campaign.kinds if kind in ON_FACES]
    total = sum(share for _, share in kept)
    return replace(campaign, kinds=tuple((kind, share / total) for kind, share in kept))


@dataclass(frozen=True, slots=True)
class Series:
    """Numbers 0 ... touches - 1, drawn from shares and read by one reader."""

    name: str
    touches: int
    kinds: Shares
    levels: Shares
    shard: int
    reader: str = AS_IS


@dataclass(frozen=True, slots=True, order=True)
class Batch:
    """Touches first ... last - 1 of a series."""

    series: str
    first: int
    last: int


def series_of(campaign: Campaign) -> tuple[Series, ...]:
    """Return the touches, and the series of the study if there is one."""
    found = [Series(TOUCHES, campaign.touches, campaign.kinds, campaign.levels, campaign.shard)]
    if campaign.study:
        for name in (AS_IS, *READERS):
            label = f"reader-{name.replace(' ', '-')}"
            kinds: Shares = (("face", 1.0),)
            found.append(
                Series(label, campaign.study, kinds, campaign.levels, campaign.shard, name)
            )
    return tuple(found)


def shards_of(series: Series) -> int:
    """Return into how many files a series goes."""
    return math.ceil(series.touches / series.shard)


def batches_of(series: Series, shard: int) -> Iterator[Batch]:
    """Yield the batches of a shard."""
    end = min((shard + 1) * series.shard, series.touches)
    for first in range(shard * series.shard, end, BATCH):
        yield Batch(series.name, first, min(first + BATCH, end))


def plan_of(
    campaign: Campaign,
    series: Series,
    database: str,
    number: int,
    labs: tuple[str, ...] = (),
    prints: str = "",
) -> tuple[str, TouchPlan]:
    """Return the kind of a touch as `kinds` names it, and the plan that draws it.

    `prints` is the listing of the printed surfaces, where these are touched.
    """
    rng = np.random.default_rng([campaign.seed, number, 1])
    kind, level = _draw(series.kinds, rng), _draw(series.levels, rng)
    surface = kind
    if kind == STRANGE:
        strange = [name for name in FOREIGN if name != BLANK]
        surface = strange[int(rng.integers(len(strange)))]
    plan = TouchPlan(database, campaign.seed, level, surface, files=campaign.surfaces == FILES,
                     prints=prints, engine=campaign.engine, sensor_per=campaign.sensor_per,
                     labs=labs,
                     policy=campaign.policy if series.name == TOUCHES else ONE)  # fmt: skip
    return kind, plan


def reader_with(reader: Reader, name: str) -> Reader:
    """Return a reader that spends as `READERS` says, and no second try beyond it."""
    if name == AS_IS:
        return reader
    candidates, steps, finalists, final_steps = READERS[name]
    effort: dict[str, int] = {
        "candidates": candidates,
        "steps": steps,
        "finalists": finalists,
        "final_steps": final_steps,
    }
    spent = replace(reader.options.first, **effort)
    return replace(reader, options=replace(reader.options, first=spent, thorough=spent))


def settings_of(name: str) -> dict[str, int]:
    """Return what a reader of the study spends, as the report names it."""
    given = DEFAULTS.first
    if name == AS_IS:
        values = (given.candidates, given.steps, given.finalists, given.final_steps)
    else:
        values = READERS[name]
    named = dict(zip(("candidates", "steps", "finalists", "final steps"), values, strict=True))
    return named | ({"second try": DEFAULTS.thorough.candidates} if name == AS_IS else {})


def shares_of(text: str, allowed: Mapping[str, object] | tuple[str, ...], option: str) -> Shares:
    """Read `face=2,edge` from an option: names with their weights, 1 where none is given.

    Raises
    ------
    ValidationError
        For a name that is not allowed, or weights that are no shares.
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


def kinds_of(text: str) -> Shares:
    """Read the shares of `--kinds`."""
    return shares_of(text, KIND_NAMES, "--kinds")


def levels_of(text: str) -> Shares:
    """Read the shares of `--levels`."""
    return shares_of(text, LEVELS, "--levels")


def _draw(shares: Shares, rng: np.random.Generator) -> str:
    ends = tuple(accumulate(share for _, share in shares))
    place = bisect_right(ends, rng.random() * ends[-1])
    return shares[min(place, len(shares) - 1)][0]


@dataclass(frozen=True, slots=True)
class CampaignOptions:
    """Options as they were given; None or empty: as in the run that is resumed, or the default."""

    touches: int | None = None
    seed: int | None = None
    kinds: str = ""
    levels: str = ""
    sensor_type: str = ""
    overlay: str = ""
    surfaces: str = ""
    print_profile: str = ""
    faults: str = ""
    engine: str = ""
    sensor_per: str = ""
    policy: str = ""
    study: int | None = None
    shard: int | None = None


def campaign_of(options: CampaignOptions, known: Campaign | None) -> Campaign:
    """Return what is record for, options over what was record before over defaults."""
    for given, allowed, option in (
        (options.overlay, ("tab", "pad"), "--overlay"),
        (options.surfaces, SURFACES, "--surfaces"),
        (options.engine, tuple(ENGINES), "--engine"),
        (options.sensor_per, ("touch", "run"), "--sensor-per"),
        (options.policy, POLICY_NAMES, "--policy"),
    ):
        if given and given not in allowed:
            raise ValidationError(
                f"'{given}' is not known", fix=f"give {' or '.join(allowed)}", place=option
            )
    base = known or Campaign()
    own = sensor_of(options.sensor_type, "").overlay.kind if options.sensor_type else ""
    touches = base.touches if options.touches is None else options.touches
    study = base.study if known else (STUDY if touches >= STUDY else 0)
    campaign = replace(
        base,
        touches=touches,
        seed=base.seed if options.seed is None else options.seed,
        kinds=kinds_of(options.kinds) if options.kinds else base.kinds,
        levels=levels_of(options.levels) if options.levels else base.levels,
        sensor_type=options.sensor_type or base.sensor_type,
        overlay=options.overlay or own or base.overlay,
        surfaces=options.surfaces or base.surfaces,
        print_profile=options.print_profile or base.print_profile,
        faults=options.faults or base.faults,
        engine=options.engine or base.engine,
        sensor_per=options.sensor_per or base.sensor_per,
        policy=options.policy or base.policy,
        study=study if options.study is None else options.study,
        shard=base.shard if options.shard is None else options.shard,
    )
    for given, option in (
        (campaign.print_profile, "--print-profile"),
        (campaign.faults, "--faults"),
    ):
        if given and campaign.surfaces != PRINTED:
            raise ValidationError(
                f"{campaign.surfaces} are touched, nothing is printed",
                fix="add --surfaces printed",
                place=option,
            )
    return touchable(campaign, bool(options.kinds))
