"""Keys of labs: what people type is what was printed, or is refused."""

import secrets

import numpy as np
import pytest

from generator.array.lab_key import CHARACTERS, LENGTH, draw_lab_key, lab_key_of, read_lab_key
from generator.errors import LabKeyError

KEY = "0123-4567-89AB-CDER"


def test_a_key_is_drawn_from_the_whole_range(monkeypatch):
    monkeypatch.setattr("generator.array.lab_key.token_bytes", secrets.token_bytes)
    keys = {draw_lab_key() for _ in range(64)}
    assert len(keys) == 64
    assert all(read_lab_key(key) == key for key in keys)
    assert set("".join(keys)) == {*CHARACTERS, "-"}


@pytest.mark.parametrize(
    "typed",
    [KEY, KEY.lower(), "0123456789abcder", " 0123 4567\t89AB-CDER\n", "oI23-4567-89ABCDER"],
)
def test_what_people_type_is_understood(typed):
    assert read_lab_key(typed) == KEY


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("", "0 characters"),
        (KEY[:-1], "15 characters"),
        (KEY + "0", "17 characters"),
        ("0123-4567-89AB-CDEU", "it holds U"),
        ("0123-4567-89AB-C*ER", "it holds \\*"),
        ("0123-4567-89AB-CDEQ", "last character does not fit"),
    ],
)
def test_what_is_no_key_is_refused_with_the_reason(typed, said):
    with pytest.raises(LabKeyError, match=said) as caught:
        read_lab_key(typed)
    assert caught.value.exit_code == 2
    assert "encode-object lab" in caught.value.fix


def test_every_wrong_character_and_every_exchange_is_found():
    rng = np.random.default_rng(1)
    plain = lab_key_of(rng.bytes(LENGTH)).replace("-", "")
    wrong = {
        plain[:k] + character + plain[k + 1 :]
        for k in range(LENGTH)
        for character in CHARACTERS
        if character != plain[k]
    }
    for a in range(LENGTH):
        for b in range(a):
            if plain[a] != plain[b]:
                swapped = list(plain)
                swapped[a], swapped[b] = swapped[b], swapped[a]
                wrong.add("".join(swapped))
    assert len(wrong) > LENGTH * 31
    for typed in wrong:
        with pytest.raises(LabKeyError):
            read_lab_key(typed)
