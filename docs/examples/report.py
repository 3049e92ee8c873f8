"""Validate a set: make it, touch the written files 40 times, read them, write a report."""

from pathlib import Path

from encoded_objects import validate

if __name__ == "__main__":
    Path("cube.yaml").write_text("name: Cube\nshape: {cube: 60 mm}\n")
    result = validate("cube.yaml", touches=40, folder="report")
    print(result)
    print(Path("report/report.html").stat().st_size > 0)
