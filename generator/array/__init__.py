"""Pseudo-random arrays: which symbol stands in which cell, what a window tells. Thesis chapter 5.

`profile` names ready choices, `array_from` takes an explicit encoding; both give a `SymbolArray`
(`contract`): a folded m-sequence (`fold`) or a product of two (`product`). `window` counts how
many wrong symbols a set of cells withstands; `lab_key` makes arrays of a lab's own.
"""

from generator.array.contract import Labels, SymbolArray
from generator.array.definition import array_from
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray
from generator.array.profiles import DEFAULT_PROFILE, PROFILES, Profile, next_larger, profile
from generator.array.sequence import Sequence
from generator.errors import ArrayError

__all__ = [
    "DEFAULT_PROFILE",
    "PROFILES",
    "ArrayError",
    "FoldedArray",
    "Labels",
    "ProductArray",
    "Profile",
    "Sequence",
    "SymbolArray",
    "array_from",
    "next_larger",
    "profile",
]
