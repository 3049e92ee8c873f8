"""The spec: what a person asks for, read from YAML and resolved.

::

    document.py   file -> values that remember line and column
    settings.py   the settings, with shape.py, encoding.py and quantity.py (pydantic)
    explain.py    validation errors in plain words, at their places
    profile.py    what a profile's name gives
    resolve.py    defaults, and what settings mean together -> resolved.ObjectSpec
    read.py       files and sets -> located.Located objects
    schema.py     the JSON schema for editors
    starter.py    commented specs to begin with

    SpecError     problem.py: every problem with place, line, caret and fix
"""

from __future__ import annotations

from generator.spec.located import LocatedSpec, error_at, locate
from generator.spec.problem import Problem, SpecError
from generator.spec.read import read_specs
from generator.spec.resolved import ObjectSpec, ShapeSpec

__all__ = [
    "LocatedSpec",
    "ObjectSpec",
    "Problem",
    "ShapeSpec",
    "SpecError",
    "error_at",
    "locate",
    "read_specs",
]
