"""The JSON schema of a spec, so that editors complete and check while one writes."""

from __future__ import annotations

from typing import Any

import yaml
from pydantic import TypeAdapter
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from encoded_objects.base.json_schema import DescribedSchema
from encoded_objects.base.sensor_type_file import shipped_names
from generator.printers import MACHINES, PRINTERS
from generator.spec.settings import ObjectSettings, Print, SetSettings
from generator.spec.shape import EXAMPLES, Shape


class _SpecSchema(DescribedSchema):
    """A setting is there with a value, or it is left out."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        inner = super().default_schema(schema)
        return {k: v for k, v in inner.items() if k != "default" or isinstance(v, str | int)}


def spec_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a spec file: an object, or a set."""
    schema = TypeAdapter(ObjectSettings | SetSettings).json_schema(schema_generator=_SpecSchema)
    shape = schema["$defs"][Shape.__name__]
    for kind, text in EXAMPLES.items():
        if "..." not in text:
            shape["properties"][kind]["examples"] = [yaml.safe_load(text)[kind]]
    blocks = schema["$defs"]
    blocks[Print.__name__]["properties"]["printer"]["examples"] = [*PRINTERS, *MACHINES]
    for block in (ObjectSettings, SetSettings):
        blocks[block.__name__]["properties"]["sensor_type"]["examples"] = [*shipped_names()]
    one_kind = {"minProperties": 1, "maxProperties": 1}
    file_with_scale = {"required": ["file"], "maxProperties": 2}
    shape |= {"if": {"required": ["scale"]}, "then": file_with_scale, "else": one_kind}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "encoded object",
        "description": "What encode-object makes: one object, or a set that shares one array.",
        **schema,
    }
