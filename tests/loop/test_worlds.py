"""A small campaign over kinds that need objects of their own, by faulty sensors."""

from types import SimpleNamespace

from generator.command import run as encode_object
from recognizer.validation import encoded_set
from recognizer.validation.campaign import Campaign, series_of
from recognizer.validation.encoded_set import is_extra
from recognizer.validation.files import columns_of, read_series
from recognizer.validation.pipeline import validate

KINDS = ("copy", "near", "small", "side", "same_profile", "decoy")
SET = """objects:
  - {name: Block, shape: {box: [60 mm, 50 mm, 40 mm]}, profile: one-touch}
  - {name: Prism, shape: {triangular_prism: {side: 50 mm, height: 40 mm}}, profile: one-touch}
"""


def test_a_campaign_over_worlds(tmp_path, monkeypatch):
    few = {"COPIES": 2, "SMALL_PITCHES": (3.3,), "LAB_OBJECTS": 1, "OTHER_LABS": 1}
    for name, count in few.items():  # each object takes time to make, as does each process
        monkeypatch.setattr(encoded_set, name, count)
    here = SimpleNamespace(
        run=lambda command, **_: SimpleNamespace(returncode=encode_object(command[3:]))
    )
    monkeypatch.setattr(encoded_set, "subprocess", here)
    (tmp_path / "set.yaml").write_text(SET)
    folder = tmp_path / "run"
    result = validate(
        tmp_path / "set.yaml", folder=folder, touches=22, seed=3, kinds=",".join(KINDS),
        levels="typical,dead-10,slide-2", sensor_per="run", study=0,
    )  # fmt: skip
    assert result.touches == 22
    rows = columns_of(read_series(folder, series_of(Campaign(22))[0]))
    assert set(rows["kind"]) <= set(KINDS)
    for kind, name in zip(rows["kind"], rows["object"], strict=True):
        if kind == "same_profile":
            assert name == ""  # nobody's, to this lab: every answer is wrong
        elif kind == "decoy":
            assert name in ("", "Block", "Prism")  # exchanged symbols are nobody's
        elif kind == "side":
            assert name in ("Block", "Prism")
        else:
            assert is_extra(name, kind)
    kept = rows["kind"] != "same_profile"
    assert not (rows["verdict"][kept] == "wrong").any()
    assert (rows["verdict"][kept] == "right").any()
