"""Errors of a stage, at the setting that causes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from generator.errors import GeneratorError
from generator.spec import LocatedSpec, error_at


@contextmanager
def errors_at(located: LocatedSpec, path: str) -> Iterator[None]:
    """Give errors of a stage the place of the setting at `path`."""
    try:
        yield
    except GeneratorError as error:
        raise error_at(located, error, path) from error
