"""Pseudo-random arrays: which symbol stands in which cell, and what a window tells.

Definition -> array -> labels. Thesis chapter 5. `profile` names ready choices, `array_from`
takes an explicit encoding; both give a `SymbolArray` (`contract`).

    factor, residue, torus        integers, GF(p)[x]/H, indices on a cycle
    field, polynomial, notation   GF(q), polynomials over it and how they are written
    primitive, size               polynomials on file, folds that decode
    sequence                      PRBS, PRMVS
    fold                          PRBA, PRMVA
    product                       PRPA, PRMVPA
    window                        minimum distance, unique windows
    touches                       how many of a sensor's touches name a place
    visible, rivals               cells that a sensor sees whole, places that look like them
    labelling, keyed, lab_key     arrays of a lab's own
    definition, profiles          arrays by plain values and by name
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
