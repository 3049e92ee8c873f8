"""Fields are described by the text under them: in the schema, not at start-up."""

import subprocess
import sys
from typing import ClassVar

from pydantic import BaseModel

from encoded_objects.base.json_schema import DescribedSchema, field_docstrings


class Inner(BaseModel):
    """A block."""

    depth: int = 1
    """How deep."""


class Outer(Inner):
    """A block that holds another one."""

    limit: ClassVar[int] = 3
    """No setting."""
    inner: Inner
    """What it
    holds."""
    plain: str = ""
    depth: int = 2
    """How deep, of the outer one."""


def test_texts_of_a_model_and_of_what_it_is_derived_from():
    assert field_docstrings(Inner) == {"depth": "How deep."}
    found = field_docstrings(Outer)
    assert found["depth"] == "How deep, of the outer one."
    assert found["inner"] == "What it\nholds."
    assert "plain" not in found


def test_schema_describes_also_what_refers_to_another_block():
    schema = Outer.model_json_schema(schema_generator=DescribedSchema)
    assert schema["properties"]["inner"]["description"] == "What it\nholds."
    assert set(schema["properties"]) == {"depth", "inner", "plain"}
    assert "description" not in schema["properties"]["plain"]
    assert schema["$defs"]["Inner"]["properties"]["depth"]["description"] == "How deep."


def test_settings_are_defined_without_their_source():
    program = (
        "import linecache, generator.spec.settings\n"
        "print([name for name in linecache.cache if 'generator' in name])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr
