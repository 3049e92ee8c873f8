"""The spec: what a person asks for, read from YAML and resolved.

::

    settings.py   the settings, with shape.py, encoding.py and name.py (pydantic)
    explain.py    validation errors in the words of specs
    profile.py    what a profile's name gives
    resolve.py    defaults, and what settings mean together -> resolved.ObjectSpec
    read.py       files and sets -> located.Located objects
    schema.py     the JSON schema for editors
    starter.py    commented specs to begin with

    SpecError     problem.py: every problem with place, line, caret and fix

How files become values that remember line and column: `encoded_objects.base.document`.
"""

from __future__ import annotations

from encoded_objects.base.document import Problem
from generator.spec.located import LocatedSpec, error_at, locate
from generator.spec.problem import SpecError
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
