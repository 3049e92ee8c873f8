"""How corpora are compared, and the short ones as they are stored."""

from corpora import make
from corpora.stored import as_stored

test_recordings_and_databases_are_as_stored = as_stored("recordings", "databases")


def test_numbers_may_round_and_nothing_else_may_differ():
    before = {"a": [1.0, None, "x"], "b": 3, "c": True}
    assert not list(make.differences(before, {"a": [1.0 + 1e-10, None, "x"], "b": 3, "c": True}))
    assert not list(make.differences(1.0, 1))
    for after in (
        {"a": [1.0 + 1e-8, None, "x"], "b": 3, "c": True},
        {"a": [1.0, 0.0, "x"], "b": 3, "c": True},
        {"a": [1.0, None, "X"], "b": 3, "c": True},
        {"a": [1.0, None], "b": 3, "c": True},
        {"a": [1.0, None, "x"], "b": 4, "c": True},
        {"a": [1.0, None, "x"], "b": 3, "c": 1},
        {"a": [1.0, None, "x"], "b": 3},
        {"a": [1.0, None, "x"], "b": 3, "c": True, "d": 0},
    ):
        assert list(make.differences(before, after))


def test_entries_are_new_gone_or_changed():
    before = {"kept": 1.0, "gone": 2, "changed": {"a": 1}}
    after = {"kept": 1.0 + 1e-12, "new": 3, "changed": {"a": 2}}
    kept, lines = make.compare(before, after)
    assert kept == {"kept": 1.0, "new": 3, "changed": {"a": 2}}
    assert [line.strip() for line in lines] == [
        "1 new", "new: 3", "1 gone", "gone: 2", "1 changed", "changed", ".a: 1 -> 2",
    ]  # fmt: skip
