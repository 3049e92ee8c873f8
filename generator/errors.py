"""What can be wrong with what a person gave us.

::

    EncodedObjectsError       exit code 2
    └── GeneratorError
        ├── SpecError         the YAML file: one or more problems, each with its place
        ├── ShapeError        a polyhedron or a file that holds one
        ├── ArrayError        an encoding that cannot be built or does not identify
        ├── LabKeyError       a lab key that is misspelt, or another than the database's
        ├── AlphabetError     a symbol that cannot be embossed as asked
        ├── LayoutError       a face that shows no place, or an array that is full
        ├── SolidError        a part that cannot be made or did not pass its proof
        ├── PrintError        a slicer that is missing or fails, or G-code that cannot be read
        ├── WriteError        exit code 1: a full disk, a folder that may not be written
        └── DatabaseError     exit code 4: cannot be opened, newer, or holds another object

Every error says what was given, what is allowed, and the way out (`fix`).
"""

from __future__ import annotations

from encoded_objects.base.errors import EncodedObjectsError


class GeneratorError(EncodedObjectsError):
    """Base of all errors of `generator`."""


class ShapeError(GeneratorError):
    """A polyhedron is not closed, not planar, not oriented, or a file holds none."""


class ArrayError(GeneratorError):
    """An encoding that cannot be built, decoded, or does not identify its windows."""


class LabKeyError(GeneratorError):
    """A lab key that is misspelt, or that is not the one of the database."""


class AlphabetError(GeneratorError):
    """A symbol that cannot be embossed as asked: an edge collapses, a gap closes."""


class LayoutError(GeneratorError):
    """A face on which no place can be identified, or an array without free cells."""


class SolidError(GeneratorError):
    """A part that cannot be made, or that did not pass its proof of closure."""


class PrintError(GeneratorError):
    """A slicer that is missing or fails, G-code that cannot be read, or no part in it."""


class WriteError(GeneratorError):
    """A file that cannot be written: no space, no right, something in its way."""

    exit_code = 1


class FileThereError(GeneratorError):
    """A file of somebody else, which is not replaced unasked."""


class DatabaseError(GeneratorError):
    """A database that cannot be opened, is newer than this tool, or refuses the object."""

    exit_code = 4
