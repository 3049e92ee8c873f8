"""Window -> index: the code conversions of thesis 5.1, 5.4.3 and appendix 5, and their heirs.

Windows (N, rows, columns) -> `Decodings`, one `Decoded` each: place, margin, reason.
Without errors (`exact`): the thesis's `milestones` (table, serial, serial-parallel), or
`logarithm`, closed form, any size. With wrong and missing symbols: `likelihood`, whose `ranking`
weighs all places; `good_tuple` is the thesis's way, the baseline.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from decoder.any_method import decode
    from decoder.decoded import Candidate, Decoded, Decodings, Reason
    from decoder.errors import DecoderError, MethodError, WindowError
    from decoder.exact import decode_exact
    from decoder.good_tuple import decode_good_tuple
    from decoder.likelihood import Likelihood, decode_likelihood
    from decoder.view import Strength, strength, strength_of_window

#: modules, loaded when one of their names is first used
_HOMES = {
    "decoder.any_method": ["decode"],
    "decoder.decoded": ["Candidate", "Decoded", "Decodings", "Reason"],
    "decoder.errors": ["DecoderError", "MethodError", "WindowError"],
    "decoder.exact": ["decode_exact"],
    "decoder.good_tuple": ["decode_good_tuple"],
    "decoder.likelihood": ["Likelihood", "decode_likelihood"],
    "decoder.view": ["Strength", "strength", "strength_of_window"],
}

__all__ = [
    "Candidate",
    "Decoded",
    "DecoderError",
    "Decodings",
    "Likelihood",
    "MethodError",
    "Reason",
    "Strength",
    "WindowError",
    "decode",
    "decode_exact",
    "decode_good_tuple",
    "decode_likelihood",
    "strength",
    "strength_of_window",
]


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(home), name)
    raise AttributeError(f"module 'decoder' has no attribute '{name}'")
