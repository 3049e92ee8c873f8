"""A build sheet -> one HTML file: no network, no script, prints on paper."""

from __future__ import annotations

from html import escape
from urllib.parse import quote

from generator.export.sheet.values import BuildSheet

_STYLE = """
body{font:15px/1.45 Helvetica,Arial,sans-serif;color:#0F172A;max-width:1000px;margin:24px auto;
padding:0 16px}h1{font-size:26px;margin:0 0 8px}h2{font-size:19px;margin:28px 0 8px}
table{border-collapse:collapse}td,th{text-align:left;padding:3px 14px 3px 0;vertical-align:top;
border-bottom:1px solid #E2E8F0}.cards{display:flex;flex-wrap:wrap;gap:18px}
figure{margin:0;padding:10px;border:1px solid #CBD5E1;border-radius:6px;break-inside:avoid}
.plates figure{width:calc(50% - 34px)}.plates svg{width:100%;height:auto}
figcaption{max-width:640px}.cards figcaption{max-width:300px}.small{color:#475569;font-size:13px}
b.mark{font-family:monospace;background:#E0E7FF;padding:0 4px}
@media print{body{margin:0}}
"""
_MIXED = (
    " Another object: a panel of another copy is glued in. Another face: panels are exchanged. "
    "A turn of a quarter or more: the panel sits turned."
)


def sheet_html(sheet: BuildSheet) -> str:
    """Return the page."""
    body = [f"<h1>{escape(sheet.title)}: build sheet</h1>", _table(sheet.facts)]
    if sheet.objects:
        head = "<tr><th>object</th><th>short code</th><th>plates</th><th>sheet</th></tr>"
        rows = "".join(
            f'<tr><td>{escape(name)}</td><td><b class="mark">{escape(code)}</b></td>'
            f'<td>{escape(plates)}</td><td><a href="{quote(link)}">{escape(link)}</a></td></tr>'
            for name, code, plates, link in sheet.objects
        )
        body.append(f"<h2>Objects and their codes</h2><table>{head}{rows}</table>")
    if sheet.files:
        several = "cards plates" if len(sheet.files) > 1 else "cards"
        body.append(f'<h2>Print</h2><div class="{several}">')
        for file, what, drawing in sheet.files:
            body.append(f"<figure>{drawing}<figcaption><b>{escape(file)}</b><br>{escape(what)}"
                        "</figcaption></figure>")  # fmt: skip
        body.append("</div>")
    if sheet.cards:
        body.append(
            "<h2>Parts</h2><p>Left: from the front, edges with their numbers. Right: the back, as "
            "engraved. A panel lies on its back, symbols up.</p>"
            '<div class="cards">'
        )
        for card in sheet.cards:
            mark = f' <b class="mark">{escape(card.mark)}</b>' if card.mark else ""
            body.append(
                f"<figure>{card.front}{card.back}<figcaption><b>{escape(card.name)}</b>{mark}"
                f'<br><span class="small">{escape(card.size)}</span></figcaption></figure>'
            )
        body.append("</div>")
    if sheet.steps:
        body.append(
            "<h2>Glue</h2><p>Edges with the same number meet. Put the panels together dry first: "
            "all marks must name the same object.</p>"
            '<div class="cards">'
        )
        for number, step in enumerate(sheet.steps, 1):
            body.append(
                f"<figure>{step.drawing}<figcaption>{number}. {escape(step.text)}</figcaption>"
                "</figure>"
            )
        body.append("</div>")
    if sheet.checks:
        rows = "".join(
            f"<tr><td>{k}.</td><td>{escape(check.where)}</td><td>{escape(check.answer)}</td></tr>"
            for k, check in enumerate(sheet.checks, 1)
        )
        body.append(
            f"<h2>Check by {'three touches' if len(sheet.checks) == 3 else 'touch'}</h2>"
            f"<p><code>recognize-object</code> or <code>open-bench</code>, 20 N or more."
            f"{_MIXED if sheet.steps else ''}</p>"
            f"<table><tr><th></th><th>touch</th><th>must answer</th></tr>{rows}</table>"
        )
    body += [f"<p>{escape(note)}</p>" for note in sheet.notes]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(sheet.title)}: build sheet</title><style>{_STYLE}</style></head><body>\n"
        + "\n".join(body)
        + "\n</body></html>\n"
    )


def _table(rows: tuple[tuple[str, str], ...]) -> str:
    lines = (f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{''.join(lines)}</table>"
