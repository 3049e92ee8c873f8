"""What a run found: the counts, the pose errors, the bounds, and whether they hold.

Results of all touches (`results`) -> ValidationResult, which prints as `validate-set` does
and whose `as_json` is `validate-set --json`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from encoded_objects.base.console import DONE, FAILED
from recognizer.validation.statistics import HOLDS


@dataclass(frozen=True, slots=True)
class ValidationBound:
    """A bound of the design and the value found; prints as a line."""

    name: str
    sign: str  #: of what must hold: =, <=, >=, or within two limits
    limit: float  #: a share, or in `unit`
    unit: str  #: empty: shares are bounded
    state: str  #: holds, fails, or too few touches to tell
    value: float | None  #: found: the share, or the size in `unit`; None: nothing to judge
    counted: tuple[int, int] | None = None  #: of a share: how many, of how many
    interval: tuple[float, float | None] | None = None  #: 95 %; None: no end is known
    upper: float | None = None  #: the other limit of `within`

    @property
    def holds(self) -> bool:
        """Whether the touches show that it holds."""
        return self.state == HOLDS

    def __str__(self) -> str:
        if self.value is None:
            return f"{self.name}: none was drawn"
        low, high = self.interval or (None, None)
        if self.counted is None:
            ends = [_size(end, "").strip() for end in (low, high)]
            said = f"{_size(self.value, self.unit)} ({' ... '.join(ends)})"
            return f"{self.name}: {said}, bound {self.sign} {self.limit:g} {self.unit}"
        said = f"{self.counted[0]:,} of {self.counted[1]:,}, {self.value:.3%}"
        if low is not None and high is not None:
            said += f" ({low:.3%} ... {high:.3%})"
        upper = "" if self.upper is None else f" ... {self.upper:.1%}"
        return f"{self.name}: {said}, bound {self.sign} {self.limit:.1%}{upper}"


@dataclass(frozen=True, slots=True)
class ValidationResult:
    """How a run ended."""

    touches: int
    right: int
    wrong: int
    rejected: int
    rms_mm: float | None  #: of the right answers; None without any
    rms_deg: float | None
    seconds: float  #: wall time of this run
    fair: int  #: touches that show enough symbols
    fair_right: int  #: of these, how many are answered right
    bounds: tuple[ValidationBound, ...]
    folder: Path  #: with report.html, results.json and trials.parquet
    faces: int = 0  #: touches of registered faces that were followed (policy `next`)
    within: tuple[int, ...] = ()  #: of these, right at once, within two touches, within three

    def __str__(self) -> str:
        head = (
            f"{self.touches:,} touches: {self.right:,} right, {self.wrong:,} wrong, "
            f"{self.rejected:,} rejected; pose {_size(self.rms_mm, 'mm')}, "
            f"{_size(self.rms_deg, 'degrees')} rms ({self.seconds:.1f} s)"
        )
        if self.within:
            shares = (f"{count:,} within {n}" for n, count in enumerate(self.within, start=1))
            head += f"\n  right of {self.faces:,} touches of registered faces: {', '.join(shares)}"
        return "\n".join([head, *(f"  {bound.state}: {bound}" for bound in self.bounds)])

    @property
    def holds(self) -> bool:
        """Whether every bound holds."""
        return all(bound.holds for bound in self.bounds)

    def as_json(self) -> dict[str, Any]:
        """Return what `validate-set --json` prints."""
        names = ("touches", "right", "wrong", "rejected", "rms_mm", "rms_deg", "seconds")
        values = {name: getattr(self, name) for name in names}
        within = {"faces": self.faces, "within": list(self.within)} if self.within else {}
        return values | within | {"folder": str(self.folder), "holds": self.holds}

    def exit_code(self, fail_under: float | None) -> int:
        """Return 1 if a touch was answered wrong or too few were answered right, in percent."""
        if fail_under is None:
            return DONE
        share = 100 * self.fair_right / self.fair if self.fair else 100.0
        return FAILED if self.wrong or share < fail_under else DONE


def result_from(results: dict[str, Any], seconds: float, folder: Path) -> ValidationResult:
    """Return what a run found, from its `results.json`."""
    totals, fair = results["totals"], results["enough"]
    followed = results.get("policy", [{"touches": 0, "within": []}])[0]
    return ValidationResult(
        touches=totals["touches"],
        right=totals["right"],
        wrong=totals["wrong"],
        rejected=totals["rejected"],
        rms_mm=totals["rms_mm"],
        rms_deg=totals["rms_deg"],
        seconds=seconds,
        fair=fair["touches"],
        fair_right=fair["right"],
        bounds=tuple(map(bound_from, results["verdict"])),
        folder=folder,
        faces=followed["touches"],
        within=tuple(share["count"] for share in followed["within"]),
    )


def bound_from(line: dict[str, Any]) -> ValidationBound:
    """Return a bound from its line in `results.json`."""
    of_shares = "share" in line
    return ValidationBound(
        name=line["name"],
        sign=line["sign"],
        limit=line["bound"],
        unit=line["unit"],
        state=line["state"],
        value=line["share" if of_shares else "value"],
        counted=(line["count"], line["of"]) if of_shares else None,
        interval=(line["low"], line["high"]),
        upper=line["upper"],
    )


def _size(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.3f} {unit}"
