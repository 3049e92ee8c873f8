"""Options as a person gives them -> the campaign that they make of defaults or an older run."""

from __future__ import annotations

from dataclasses import dataclass, replace

from probe.contact.engines import ENGINES
from recognizer.validation.campaign import (
    PRINTED,
    SURFACES,
    Campaign,
    kinds_of,
    levels_of,
    touchable,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.policy import POLICY_NAMES
from recognizer.validation.settings import STUDIES
from recognizer.validation.touch_plan import sensor_of


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
    study = base.study if known else STUDIES.touches_of(touches)
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
