"""Canonical JSON: the one text of a plain value, and its digest."""

from __future__ import annotations

import hashlib
import json
from typing import Any


def canonical(value: Any) -> str:
    """Return the JSON text of `value` with sorted keys, no blanks, and no NaN.

    Floats are written so that they read back bit for bit. Raises `TypeError` on what
    JSON does not know and `ValueError` on NaN and infinity.

    Examples
    --------
    >>> canonical({"b": [1, 0.1], "a": "é"})
    '{"a":"é","b":[1,0.1]}'
    """
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )


def digest(text: str) -> str:
    """Return the SHA-256 of the UTF-8 bytes of `text`, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def spec_hash(spec: Any) -> str:
    """Return the digest of a spec given as plain values: equal specs, equal hashes."""
    return digest(canonical(spec))
