"""The JSON schema of blocks of settings: the text under a field is its description.

pydantic would take these texts from the source whenever a model is defined, at each start of a
command (60 ms); they are read here, where somebody asks for them.
"""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from textwrap import dedent

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema


class DescribedSchema(GenerateJsonSchema):
    """A JSON schema whose properties are described by the docstrings of the fields."""

    def model_schema(self, schema: core_schema.ModelSchema) -> JsonSchemaValue:
        """Return the schema of one block."""
        found = super().model_schema(schema)
        for name, text in field_docstrings(schema["cls"]).items():
            if name in found["properties"]:
                found["properties"][name]["description"] = text
        return found


def field_docstrings(model: type[BaseModel]) -> dict[str, str]:
    """Return the text under each field of a model and of those it is derived from."""
    found: dict[str, str] = {}
    for block in reversed(model.__mro__):
        if not issubclass(block, BaseModel) or block is BaseModel:
            continue
        definition = ast.parse(dedent(inspect.getsource(block))).body[0]
        assert isinstance(definition, ast.ClassDef)
        for field, text in pairwise(definition.body):
            if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
                continue
            match text:
                case ast.Expr(ast.Constant(str(words))):
                    found[field.target.id] = inspect.cleandoc(words)
    return found
