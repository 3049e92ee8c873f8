"""Numbers that decide where a scan touches next, and how it comes near."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TouchPathSettings:
    """From touch to touch."""

    step_tactels: float = 4.25
    """From touch to touch, so that neighbours share three quarters; thesis 4.3."""
    short: float = 0.7  #: share of the step that the stiffness so far would ask for


TOUCH_PATH = TouchPathSettings()
