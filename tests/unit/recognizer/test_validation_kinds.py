"""Kinds of touches that need objects of their own: what is made, what is drawn, what is refused."""

import pytest

from recognizer.validation.campaign import KIND_NAMES, kinds_of
from recognizer.validation.encoded_set import (
    EXTRA,
    OTHER_LABS,
    is_extra,
    labs_of,
    refuse_without_specs,
)
from recognizer.validation.errors import ValidationError


def test_every_kind_can_be_named():
    assert [name for name, _ in kinds_of(",".join(KIND_NAMES))] == list(KIND_NAMES)


def test_members_of_a_kind_are_not_touched_as_members_of_the_set():
    for kind, name in EXTRA.items():
        assert is_extra(f"{name}-3", kind)
        assert not is_extra(f"{name}-3", "face")
        assert not is_extra("Cube-1", kind)
        assert not any(is_extra(f"{name}-3", other) for other in EXTRA if other != kind)
    assert is_extra("Cube-1", "face")


def test_nothing_is_registered_in_a_database_that_is_only_named():
    refuse_without_specs(["face", "side", "same_profile"])
    with pytest.raises(ValidationError, match="copy, small need objects of their own"):
        refuse_without_specs(["face", "copy", "small"])


def test_other_labs_are_touched_by_their_kind_alone(tmp_path):
    assert labs_of(tmp_path, ["face", "copy"]) == ()
    labs = labs_of(tmp_path, ["same_profile"])
    assert len(set(labs)) == OTHER_LABS
    assert all(lab.startswith(str(tmp_path)) for lab in labs)
