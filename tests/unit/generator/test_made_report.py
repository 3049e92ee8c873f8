"""What `encode-object` says of copies, and of the files of a set."""

from __future__ import annotations

from pathlib import Path

from generator.command.made_report import print_made
from generator.layout.placement import Layout
from generator.layout.recognition_rate import RecognitionRate
from generator.pipeline import Encoded, MadeObject
from generator.pipeline.faces import FaceReport

LAYOUT = Layout("faces", 7.0, ())


def copy(number: int, name: str = "Cube", symbols: int = 384) -> MadeObject:
    folder = Path("out") / f"{name}-{number}"
    files = tuple(folder / f"{name}-{number}-F{face}.step" for face in (1, 2))
    return MadeObject(f"{name}-{number}", 6, symbols, 200, 6, files, (), False, LAYOUT)


def said(objects, capsys, set_files=()):
    made = Encoded(tuple(objects), "sqlite:///lab.db", 51, 1285, 5000, 1.0, set_files=set_files)
    print_made(made, dry_run=False, as_json=False)
    return capsys.readouterr().out


def test_copies_that_differ_are_said_each(capsys):
    text = said([copy(1), copy(2, symbols=380)], capsys)
    assert "Cube-1: made; 6 faces, 384 symbols" in text
    assert "Cube-2: made; 6 faces, 380 symbols" in text


def test_faces_of_which_the_same_is_to_be_said_share_a_line(capsys):
    def face(number, width):
        size, promise = (width, 50.0), RecognitionRate(0.7, 0.99)
        return FaceReport(
            f"F{number}", "", "plane", size, width * 50.0, 63, 40, promise, (16.0, 20.0)
        )

    faces = tuple(face(k, 40.0 if k in (1, 4) else 60.0) for k in range(1, 13))
    made = MadeObject("Block", 12, 700, 200, 12, (), (), False, LAYOUT, face_reports=faces)
    text = said([made], capsys)
    assert (
        "  F1, F4:           40 x 50 mm, 63 symbols, 70% answered at once, 99% within three, "
        "it could be as small as 16 x 20 mm" in text
    )
    assert "  F2 and 9 like it: 60 x 50 mm" in text
