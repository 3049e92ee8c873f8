"""Every number that decides how a touch is read: one frozen value, a part for each stage.

Lengths in mm, angles in rad, forces in N, log-likelihoods in nats; "tactels" are pitches of the
sensor, "heights" those of the overlay. Where nothing else is said a value was chosen with the
others on simulated touches of the 40 objects of `docs/validation/forty.yaml` (typical noise and
strong mismatch; `tests/bench/recognizer_times.py` shows error against time), not measured alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from recognizer.touch.settings.answer import (
    BeliefSettings,
    BorderSettings,
    ExchangedSettings,
    FirstLookSettings,
    HypothesisSettings,
    NextSettings,
    PrintedSettings,
)
from recognizer.touch.settings.image import (
    ContactSettings,
    LabSettings,
    SignalSettings,
)
from recognizer.touch.settings.symbols import (
    BendSettings,
    CovarianceSettings,
    FitSettings,
    GainSettings,
    LoadedAreaSettings,
    NoiseSettings,
    PosteriorSettings,
    RefineSettings,
    RoundSettings,
    SearchSettings,
    SpreadSettings,
    StretchSettings,
    TemplateSettings,
)

__all__ = [
    "DEFAULTS",
    "BeliefSettings",
    "BendSettings",
    "BorderSettings",
    "ContactSettings",
    "CovarianceSettings",
    "ExchangedSettings",
    "FirstLookSettings",
    "FitSettings",
    "GainSettings",
    "HypothesisSettings",
    "LabSettings",
    "LoadedAreaSettings",
    "NextSettings",
    "NoiseSettings",
    "PosteriorSettings",
    "PrintedSettings",
    "ReaderSettings",
    "RefineSettings",
    "RoundSettings",
    "SearchSettings",
    "SignalSettings",
    "SpreadSettings",
    "StretchSettings",
    "TemplateSettings",
]


@dataclass(frozen=True, slots=True)
class ReaderSettings:
    """All numbers that decide in `recognizer.touch`.

    Examples
    --------
    >>> ReaderSettings().belief.least_inliers
    4
    >>> ReaderSettings(belief=BeliefSettings(margin=20.0)).belief.surprise
    3.0
    """

    lab: LabSettings = field(default_factory=LabSettings)
    signal: SignalSettings = field(default_factory=SignalSettings)
    contacts: ContactSettings = field(default_factory=ContactSettings)
    template: TemplateSettings = field(default_factory=TemplateSettings)
    gain: GainSettings = field(default_factory=GainSettings)
    loaded: LoadedAreaSettings = field(default_factory=LoadedAreaSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    refine: RefineSettings = field(default_factory=RefineSettings)
    stretch: StretchSettings = field(default_factory=StretchSettings)
    covariance: CovarianceSettings = field(default_factory=CovarianceSettings)
    spread: SpreadSettings = field(default_factory=SpreadSettings)
    posterior: PosteriorSettings = field(default_factory=PosteriorSettings)
    first: FitSettings = field(default_factory=FitSettings)  #: the first try
    #: the second, of touches that the first does not answer or that few cells speak for: seven
    #: times the work (`docs/recognizer.md`)
    thorough: FitSettings = field(default_factory=lambda: FitSettings(12, 4, 6, 6, crossed=3))
    hypotheses: HypothesisSettings = field(default_factory=HypothesisSettings)
    belief: BeliefSettings = field(default_factory=BeliefSettings)
    border: BorderSettings = field(default_factory=BorderSettings)
    bends: BendSettings = field(default_factory=BendSettings)
    round: RoundSettings = field(default_factory=RoundSettings)
    printed: PrintedSettings = field(default_factory=PrintedSettings)
    exchanged: ExchangedSettings = field(default_factory=ExchangedSettings)
    first_look: FirstLookSettings = field(default_factory=FirstLookSettings)
    next: NextSettings = field(default_factory=NextSettings)


#: As the reader is, if nothing else is asked for.
DEFAULTS = ReaderSettings()
