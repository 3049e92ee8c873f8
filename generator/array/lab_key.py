"""The key of a lab: 75 random bits as 15 characters and one that checks them, XXXX-XXXX-XXXX-XXXX.

Characters are Crockford's 32, without I, L, O and U: a key is read aloud, typed and copied by
hand. They stand for the elements of GF(32); the check character makes sum A^k c_k = 0, which
finds every single wrong character and every two that were exchanged.
"""

from __future__ import annotations

import re
from functools import reduce
from secrets import token_bytes

from generator.array.field import field_of_order
from generator.errors import LabKeyError

CHARACTERS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
LENGTH = 16  #: characters, the last of which checks the others
GROUP = 4

_MEANT = str.maketrans("ILO", "110")  # what people write for 1 and 0


def draw_lab_key() -> str:
    """Return a key that no other lab has."""
    return lab_key_of(token_bytes(LENGTH))


def lab_key_of(drawn: bytes) -> str:
    """Return the key of 15 random bytes or more.

    Examples
    --------
    >>> lab_key_of(bytes(range(15)))
    '0123-4567-89AB-CDER'
    """
    labels = [byte % len(CHARACTERS) for byte in drawn[: LENGTH - 1]]
    return _text([*labels, _check_label(labels)])


def read_lab_key(text: str) -> str:
    """Return a key as it is written, from how a person typed it.

    Raises
    ------
    LabKeyError
        It has another length, a character that no key has, or its check character does not fit.

    Examples
    --------
    >>> read_lab_key("o123 4567 89ab cder")
    '0123-4567-89AB-CDER'
    """
    typed = re.sub(r"[\s-]", "", text).upper().translate(_MEANT)
    strange = sorted(set(typed) - set(CHARACTERS))
    if len(typed) != LENGTH or strange:
        has = f"it holds {' '.join(strange)}" if strange else f"it has {len(typed)} characters"
        raise LabKeyError(
            f"'{text}' is no lab key: {has}",
            fix=f"give {LENGTH} letters and digits, as `encode-object lab` prints them",
        )
    labels = [CHARACTERS.index(character) for character in typed]
    if _check_label(labels[:-1]) != labels[-1]:
        raise LabKeyError(
            f"'{text}' is no lab key: its last character does not fit the others, so one of them "
            "is wrong",
            fix="copy it once more from `encode-object lab`",
        )
    return _text(labels)


def _check_label(labels: list[int]) -> int:
    """Return c with A c_1 + ... + A^15 c_15 + c = 0 over GF(32); -x = x there."""
    field = field_of_order(len(CHARACTERS))
    terms = [int(field.multiplication[k + 2, label]) for k, label in enumerate(labels)]  # A^(k + 1)
    return reduce(lambda total, term: int(field.addition[total, term]), terms, 0)


def _text(labels: list[int]) -> str:
    typed = "".join(CHARACTERS[label] for label in labels)
    return "-".join(typed[k : k + GROUP] for k in range(0, LENGTH, GROUP))
