"""How many touches could be answered at best, by their symbols, and how many are.

A touch can be answered if its true place is the likeliest of all registered ones, by the widest
search, and its doubt (symbols alone, or with the border of the face) is below the reader's limit;
whatever else the reader asks of an answer can only refuse more. Faces under 3-20 N, edges, corners.

    python tests/campaigns/bounds.py lab.db --touches 400 --seed 7
    python tests/campaigns/bounds.py lab.db --touches 120 --seed 7 --engine mujoco
"""

from __future__ import annotations

import runner

from recognizer.touch.chance import expected_by_border, expected_matches
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import answer_at, recognise
from recognizer.touch.signal import Signal
from recognizer.touch.verify import TouchImages, verify_hypotheses
from recognizer.validation.campaign import LEVEL_SHARES, Campaign, Work, series_of
from recognizer.validation.draw import draw_touch
from recognizer.validation.trial import RIGHT, judge

SETS = (
    ("faces, 3-20 N", "face", (("light", 1.0),)),
    ("edges", "edge", LEVEL_SHARES),
    ("corners", "corner", LEVEL_SHARES),
)


def doubt_of_best(reader: Reader, signal: Signal, judged) -> float | None:
    """Return the doubt of the likeliest place of a touch; None where it is not the true one."""
    found = verify_hypotheses(TouchImages(reader, signal), reader.options.thorough)
    if not found:
        return None
    best, arrays = found[0], reader.lab.arrays
    answer = answer_at(
        best.embossed, best.last_fit(), best.hypothesis, reader.options, 0,
        reason="", margin=0.0, runner_up=None,
    )  # fmt: skip
    if judged(answer) != RIGHT:
        return None
    tip_mm = reader.sensor.overlay.tab_diameter_mm
    by_symbols = expected_matches(arrays, best.embossed, best.fit, best.hypothesis)
    return min(by_symbols, expected_by_border(arrays, best, tip_mm))


def main() -> None:
    """Print a line for each set of touches."""
    asked = runner.asked(__doc__, "database", touches=400, seed=7, engine="own")
    reader = Reader(open_lab(asked.database))
    limit = reader.options.doubt
    heads = ("of", "likeliest place true", f"and doubt <= {limit:g}", "answered")
    runner.table((f"touches, {asked.engine}", *heads))
    for name, kind, levels in SETS:
        campaign = Campaign(asked.touches, asked.seed, ((kind, 1.0),), levels, engine=asked.engine)
        series, work = series_of(campaign)[0], Work(campaign, asked.database)
        true = sure = answered = 0
        for number in range(asked.touches):
            plan = work.plan(series, number)
            drawn = draw_touch(plan, number, reader)

            def judged(answer, plan=plan, number=number, drawn=drawn) -> str:
                return judge(plan, number, drawn, answer, reader).verdict

            signal = reader.signal(drawn.counts)
            doubt = doubt_of_best(reader, signal, judged) if signal.contact else None
            true += doubt is not None
            sure += doubt is not None and doubt <= limit
            answered += judged(recognise(reader, signal, number)) == RIGHT
        runner.row(name, asked.touches, true, sure, answered)


if __name__ == "__main__":
    main()
