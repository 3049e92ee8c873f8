"""What every block of settings shares: unknown names are refused, empty lines are left out."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator

from encoded_objects.base.document.quantity import refuse


class Block(BaseModel):
    """A block of settings."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _without_empty_lines(cls, value: Any) -> Any:
        """Take a known setting without a value (`symbols:`) as not given."""
        if not isinstance(value, dict):
            return value
        return {k: v for k, v in value.items() if v is not None or k not in cls.model_fields}


def path_text(value: Any) -> str:
    """Return the name of a file or folder."""
    if not isinstance(value, str):
        raise refuse(f"a path must be text, not {value!r}", f"put it in quotes: '{value}'")
    if not value.isprintable() or not value.strip():
        raise refuse(f"{value!r} is no path", "leave control characters out")
    return value


def whole_number(low: int, high: int, what: str) -> BeforeValidator:
    """Return a validator of whole numbers from `low` to `high`."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse(f"{what} must be a whole number", f"write a number from {low} to {high}")
        if not low <= value <= high:
            shown = str(value) if abs(value) < 10**12 else "the number given"
            raise refuse(
                f"{what} must be {low} to {high}, not {shown}",
                f"write a number from {low} to {high}",
            )
        return value

    return BeforeValidator(check)


PathText = Annotated[str, BeforeValidator(path_text)]
