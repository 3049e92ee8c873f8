"""The spec: what a person asks for, read from YAML and resolved.

::

    settings.py   the settings (pydantic), with shape.py
    explain.py    validation errors in the words of specs
    resolve.py    defaults, and what settings mean together -> resolved.ObjectSpec
    read.py       files, sets, values of a script -> ObjectSpec
    option.py     options of commands, by the rules of specs
    starter.py    commented specs to begin with
    schema.py     the JSON schema for editors
    problem.py    SpecError: every problem with place, line, caret and fix
"""

from __future__ import annotations

from encoded_objects.base.document import Problem
from generator.spec.problem import SpecError
from generator.spec.read import read_specs
from generator.spec.resolved import ObjectSpec, ShapeSpec

__all__ = ["ObjectSpec", "Problem", "ShapeSpec", "SpecError", "read_specs"]
