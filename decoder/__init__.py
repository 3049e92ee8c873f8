"""Window -> index: the code conversions of thesis 5.1, 5.4.3 and appendix 5, and their heirs.

Windows (N, rows, columns) -> `Decodings`, one `Decoded` each: place, margin, reason::

    window, decoded        labels and log-likelihoods in, places out
    view                   rank and minimum distance of any set of visible cells
    exact                  windows without errors, by one of four methods:
      milestones             the thesis's: parallel (table), serial, serial-parallel
      logarithm              closed form, any size
    likelihood             wrong and missing symbols, soft scores, prior, rotations:
      ranking                all places, those of a prior, or of a product array
      transform, ordered     folded arrays: small ones exactly, large ones nearly
    good_tuple             the thesis's way with wrong symbols, the baseline
    element, register      field elements; symbols seen as linear equations of them
    any_method, registered one window by any method, on a lab's array too
    command, plot          decode-window
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
