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

#: name: the module that holds it, loaded when it is first used
_HOMES = {
    "Candidate": "decoder.decoded",
    "Decoded": "decoder.decoded",
    "DecoderError": "decoder.errors",
    "Decodings": "decoder.decoded",
    "Likelihood": "decoder.likelihood",
    "MethodError": "decoder.errors",
    "Reason": "decoder.decoded",
    "Strength": "decoder.view",
    "WindowError": "decoder.errors",
    "decode": "decoder.any_method",
    "decode_exact": "decoder.exact",
    "decode_good_tuple": "decoder.good_tuple",
    "decode_likelihood": "decoder.likelihood",
    "strength": "decoder.view",
    "strength_of_window": "decoder.view",
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
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'decoder' has no attribute '{name}'")
