"""Sections of a sheet -> one HTML page: no network, no script, prints on paper.

Build sheets of objects and sets, and the sheet of a probe kit, share `sheet.html.j2`.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from encoded_objects.base.pages import page_environment


@dataclass(frozen=True, slots=True)
class Mark:
    """A cell with what a part bears, or a link."""

    text: str
    url: str = ""


Cell = str | Mark


@dataclass(frozen=True, slots=True)
class Figure:
    """Drawings with their caption."""

    drawing: str  #: SVG; empty where there is none
    text: str
    name: str = ""
    mark: str = ""
    small: bool = False  #: the text


@dataclass(frozen=True, slots=True)
class Section:
    """One heading and its content, in this order; empty fields are left out."""

    title: str = ""
    text: str = ""
    head: Sequence[str] = ()  #: of the table; without one the first cell of a row is its name
    rows: Sequence[Sequence[Cell]] = ()
    figures: Sequence[Figure] = ()
    across: int = 2  #: figures a row
    new_page: bool = False  #: on paper
    steps: Sequence[str] = ()
    drawing: str = ""  #: SVG, or a picture
    notes: Sequence[str] = ()


def sheet_html(title: str, sections: Sequence[Section]) -> str:
    """Return the page."""
    environment = page_environment(Path(__file__).parent)
    return environment.get_template("sheet.html.j2").render(title=title, sections=sections)


def picture_html(png: bytes) -> str:
    """Return a picture that stands in the page itself."""
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
