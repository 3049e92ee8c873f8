"""Errors of a stage, at the setting that causes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from generator.errors import GeneratorError
from generator.spec import Located, blamed


@contextmanager
def blaming(located: Located, path: str) -> Iterator[None]:
    """Give errors of a stage the place of the setting at `path`."""
    try:
        yield
    except GeneratorError as error:
        raise blamed(located, error, path) from error
