"""The front door of encoded objects: about a dozen names over the four packages.

::

    encode            a spec, a solid, a mesh -> printable parts and a registered object
    open_lab          a lab's database -> what a touch can be told apart from
    Reader            of a lab -> object, face and pose of a touch: a `Recognition`
    Recording         a file of frames, each a `Frame`
    SensorType        what the probe is
    Scan              several touches of one face -> one belief
    simulate          a part or a face, touched -> frames with their truth
    decode            a window -> its place on the array
    validate          a set made, touched and read -> right, wrong, refused
    EncodedObjectsError   the root of every error that a person can cause

    >>> from encoded_objects import decode
    >>> print(decode("01 11 01 01 00 01", profile="thesis"))
    row 1, column 61 (t = 2206)

A name is loaded from its package when it is first used.
"""

from __future__ import annotations

__version__ = "0.2.0"

#: name: the module that holds it; `__init__.pyi` says the same to type checkers
HOMES = {
    "EncodedObjectsError": "encoded_objects.base.errors",
    "Frame": "probe.frame",
    "Reader": "recognizer.touch.reader",
    "Recognition": "recognizer.touch.recognition",
    "Recording": "probe.recording.read",
    "Scan": "recognizer.scan.session",
    "SensorType": "encoded_objects.base.sensor_type",
    "decode": "decoder.any_method",
    "encode": "generator.cad.encode",
    "open_lab": "recognizer.touch.lab",
    "simulate": "probe.simulate.simulation",
    "validate": "recognizer.validation.pipeline",
}

__all__ = ["__version__", *HOMES]


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module 'encoded_objects' has no attribute '{name}'")
    from importlib import import_module  # `__init__.pyi` has the types: typing alone takes 10 ms

    try:
        value: object = getattr(import_module(HOMES[name]), name)
    except ModuleNotFoundError as error:
        from encoded_objects.base.errors import without_touch

        raise without_touch(error, f"encoded_objects.{name}") or error from error
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
