"""Letters that tactels tell apart: sets of glyphs whose nearest two are as far apart as can be.

    python tests/campaigns/alphabets.py --sensor-type fsr-16 --pitch 5 --reach 0.30 --stroke 0.20

A glyph is a connected set of one to four segments between neighbours of 3 x 3 nodes; segments
that meet make 60 degrees at least, and none cross but in a node. Its image is what the tactels of
a sensor type answer to it (`recognizer.touch.symbols.template`). The distance of two glyphs is that
of their images, squared, after the shift, turn and gain that a fit leaves open and that make them
most alike, averaged over turns and places of the tactels. No two letters of a set are one another
shifted or turned, none looks the same after a quarter turn, and all have about the same ink, so
that force does not tell them apart. Several pitches, reaches and strokes are tried each with each.
`--printer` leaves out the glyphs that it does not make. Printed: the least distance of each set, as
a share of that of dense-4 at the type's usual pitch, which sets nozzles of .4 and .6 mm make, and
their strokes. `--draw FILE.svg` draws the sets that ship, and searches for nothing.
"""

import math
from dataclasses import replace
from itertools import combinations, pairwise, product
from pathlib import Path

import numpy as np
import runner

from encoded_objects.base.sensor_type_file import sensor_type_named
from generator.alphabet import ALPHABETS, Alphabet, Glyph, SymbolStyle
from generator.alphabet.printable import is_printable
from generator.printers import PRINTERS
from generator.spec.resolve import DRAFTS_RAD
from recognizer.touch.symbols.template import template_of

TURNS, PLACES = 12, 4  #: poses of the tactels: turns, and places along x and y
SHIFT_MM, TURN_RAD, GAIN = 0.2, math.radians(3.0), 0.15  #: left open by a fit, each way
INK = 1.6  #: most ink of a letter over the least of its set
SEGMENTS_MOST = 4  #: of a glyph
TRIALS = 6  #: beginnings of the search for a set

NODES = list(product((-1, 0, 1), repeat=2))
SEGMENTS = [
    (a, b) for a, b in combinations(NODES, 2) if max(abs(a[0] - b[0]), abs(a[1] - b[1])) == 1
]
NUMBER = {segment: number for number, segment in enumerate(SEGMENTS)}
PRINTED = ("fdm-0.4", "fdm-0.6")  #: printers that are asked whether they make a set
SHIPPED = ("dense-4", "dense-8", "tactel-4", "tactel-8", "tactel-16")


def segment(a, b):
    """Return the number of the segment between two nodes."""
    return NUMBER[min(a, b), max(a, b)]


def is_glyph(numbers):
    """Whether segments are connected, meet under 60 degrees at least and do not cross."""
    left, reached = set(numbers), set(SEGMENTS[numbers[0]])
    while joined := [k for k in left if reached & set(SEGMENTS[k])]:
        left -= set(joined)
        reached |= {node for k in joined for node in SEGMENTS[k]}
    if left:
        return False
    out = {}
    for k in numbers:
        for one, other in (SEGMENTS[k], SEGMENTS[k][::-1]):
            out.setdefault(one, []).append(np.subtract(other, one))
    for ways in out.values():
        for u, v in combinations(ways, 2):
            if u @ v > 0.5 * math.hypot(*u) * math.hypot(*v) + 1e-9:
                return False
    middles = [np.add(*SEGMENTS[k]).tolist() for k in numbers]
    return all(one != other for one, other in combinations(middles, 2))


def turned(numbers):
    """Return the glyph turned by a quarter."""
    return [segment((-ay, ax), (-by, bx)) for (ax, ay), (bx, by) in (SEGMENTS[k] for k in numbers)]


def shape(numbers):
    """Return what all glyphs have in common that are this one shifted."""
    points = np.array([SEGMENTS[k] for k in numbers])
    moved = (points - points.min(axis=(0, 1))).tolist()
    return tuple(sorted(tuple(sorted(map(tuple, one))) for one in moved))


def glyphs():
    """Return the glyphs, one of those that are one another turned, and their shapes."""
    found = {}
    for count in range(1, SEGMENTS_MOST + 1):
        for numbers in combinations(range(len(SEGMENTS)), count):
            if is_glyph(numbers):
                orbit = [list(numbers)]
                for _ in range(3):
                    orbit.append(turned(orbit[-1]))
                if len({shape(one) for one in orbit}) == 4:
                    found[min(tuple(sorted(one)) for one in orbit)] = min(map(shape, orbit))
    return list(found), list(found.values())


def template(letters, sensor, pitch, reach, stroke):
    """Return what tactels answer to letters, sets of segments."""
    style = SymbolStyle(pitch_mm=pitch, stroke_mm=stroke * pitch)
    return template_of(alphabet_of(letters, reach, stroke), style, sensor)


def alphabet_of(letters, reach, stroke):
    """Return letters, sets of segments, as an alphabet."""
    glyphs = tuple(
        Glyph(str(number), tuple(SEGMENTS[k] for k in one)) for number, one in enumerate(letters)
    )
    return Alphabet("found", glyphs, reach, stroke)


def distances(letters, sensor, pitch, reach, stroke):
    """Return distances (n, n) of letters and their ink (n,), mean over turns and places."""
    answers = template(letters, sensor, pitch, reach, stroke)
    axes = [
        step * np.arange(-(around := math.ceil((answers.half_mm + SHIFT_MM) / step)), around + 1)
        for step in sensor.step_mm
    ]
    tactels = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)

    def images(x, y, turn):
        c, s = math.cos(turn), math.sin(turn)
        return answers.at((tactels - (x, y)) @ np.array([[c, -s], [s, c]]))[..., 0].T

    total, ink = np.zeros((len(letters), len(letters))), np.zeros(len(letters))
    shifts, turns = (-SHIFT_MM, 0.0, SHIFT_MM), (-TURN_RAD, 0.0, TURN_RAD)
    steps = (np.arange(PLACES) + 0.5) / PLACES - 0.5
    poses = list(product(*(step * steps for step in sensor.step_mm), range(TURNS)))
    for x, y, number in poses:
        pose = np.array([x, y, math.tau * number / TURNS])
        base = images(*pose)
        own = (base * base).sum(1)
        best = np.full((len(base), len(base)), np.inf)
        for open_ in product(shifts, shifts, turns):
            moved = images(*(pose + open_))
            both, other = moved @ base.T, (moved * moved).sum(1)[:, None]
            gain = np.clip(both / np.maximum(other, 1e-9), math.exp(-GAIN), math.exp(GAIN))
            best = np.minimum(best, gain * gain * other - 2 * gain * both + own)
        total += np.minimum(best, best.T)
        ink += base.sum(1)
    return total / len(poses), ink / len(poses)


def prints(letters, pitch, reach, stroke, printer):
    """Whether a printer makes letters at one of the drafts that `auto` tries."""
    alphabet, limits = alphabet_of(letters, reach, stroke), PRINTERS[printer]
    style = SymbolStyle(pitch_mm=pitch, stroke_mm=stroke * pitch)
    styles = (replace(style, draft_rad=draft) for draft in DRAFTS_RAD)
    return any(is_printable(alphabet, one, limits) for one in styles)


def least(apart):
    """Return the least distance of a set, and between which two."""
    shown = apart + np.diag(np.full(len(apart), np.inf))
    return float(shown.min()), np.unravel_index(int(shown.argmin()), shown.shape)


def far_set(apart, size, rng):
    """Return a set of letters, each exchanged while the nearest two come farther apart."""
    best = (0.0, [])
    for _ in range(TRIALS):
        chosen = [int(rng.integers(len(apart)))]
        while len(chosen) < size:
            chosen.append(int(apart[chosen].min(0).argmax()))
        better = True
        while better:
            near, pair = least(apart[np.ix_(chosen, chosen)])
            better = False
            for out in pair:
                rest = chosen[:out] + chosen[out + 1 :]
                other = [*rest, int(apart[rest].min(0).argmax())]
                if least(apart[np.ix_(other, other)])[0] > near + 1e-9:
                    chosen, better = other, True
                    break
        best = max(best, (near, chosen))
    return best


def best_set(apart, ink, size):
    """Return the best set of letters of about the same ink; none: (0.0, [])."""
    best = (0.0, [])
    for low in np.unique(ink.round(2)):
        alike = np.flatnonzero((ink >= low - 1e-6) & (ink <= low * INK))
        if len(alike) >= size:
            near, chosen = far_set(apart[np.ix_(alike, alike)], size, np.random.default_rng(0))
            best = max(best, (near, alike[chosen].tolist()))
    return best


def lines(numbers):
    """Return a glyph as broken lines through nodes, as `known.py` writes them."""
    left, found = [SEGMENTS[k] for k in numbers], []
    while left:
        ends = [node for one in left for node in one]
        odd = [node for node in sorted(ends) if ends.count(node) % 2]
        line = [(odd or sorted(ends))[0]]
        while nexts := [one for one in left if line[-1] in one]:
            ways = {one[one[0] == line[-1]]: one for one in nexts}
            ahead = None
            if line[1:]:
                (x, y), (before_x, before_y) = line[-1], line[-2]
                ahead = 2 * x - before_x, 2 * y - before_y
            node = ahead if ahead in ways else min(ways)
            left.remove(ways[node])
            line.append(node)
        kept = [b for a, b, c in zip(line, line[1:], line[2:], strict=False)
                if np.subtract(b, a).tolist() != np.subtract(c, b).tolist()]  # fmt: skip
        found.append(", ".join(map(str, [line[0], *kept, line[-1]])))
    return " + ".join(f"line({one})" for one in found)


def shipped(name):
    """Return the letters of an alphabet as sets of segments."""
    found = []
    for glyph in ALPHABETS[name].glyphs:
        parts = []
        for a, b in glyph.strokes:
            count = max(abs(b[0] - a[0]), abs(b[1] - a[1]))
            nodes = [tuple(a[k] + (b[k] - a[k]) * n // count for k in (0, 1))
                     for n in range(count + 1)]  # fmt: skip
            parts += [segment(*pair) for pair in pairwise(nodes)]
        found.append(parts)
    return found


def drawing(names):
    """Return alphabets as SVG, one a line."""
    parts, widest = [], max(ALPHABETS[name].order for name in names)
    for line, name in enumerate(names):
        alphabet = ALPHABETS[name]
        unit = 50 * alphabet.reach
        parts.append(f'<text x="8" y="{50 * line + 30}">{name}</text>')
        for column, glyph in enumerate(alphabet.glyphs):
            x, y = 50 * column + 125, 50 * line + 25
            way = " ".join(
                f"M{x + unit * a[0]:g} {y - unit * a[1]:g}L{x + unit * b[0]:g} {y - unit * b[1]:g}"
                for a, b in glyph.strokes
            )
            parts.append(f'<path d="{way}" stroke-width="{50 * alphabet.stroke_ratio:g}"/>')
    size = f"{50 * widest + 110} {50 * len(names)}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" font-family="sans-serif" '
        'font-size="15" fill="none" stroke="#234" stroke-linecap="round" stroke-linejoin="round">'
        "<style>text{fill:#234;stroke:none}</style>" + "".join(parts) + "</svg>\n"
    )


def main() -> None:
    """Print the best sets of a sensor type, for pitches, reaches and strokes."""
    asked = runner.asked(
        __doc__, sensor_type="fsr-16", pitch=[5.0], reach=[0.30], stroke=[0.20],
        letters=[4, 8, 16, 32], printer="", draw="",
    )  # fmt: skip
    if asked.draw:
        Path(asked.draw).write_text(drawing(SHIPPED))
        return
    sensor = sensor_type_named(asked.sensor_type)

    def near_of(name, pitch):
        known = ALPHABETS[name]
        return least(distances(shipped(name), sensor, pitch, known.reach, known.stroke_ratio)[0])[0]

    unit = near_of("dense-4", sensor.symbol_pitch_mm)
    every = list(zip(*glyphs(), strict=True))
    sets = []
    heads = ("pitch", "reach", "stroke", *(f"{size} letters" for size in asked.letters))
    runner.table((*heads, *(f"{printer} makes" for printer in PRINTED)))
    for pitch, reach, stroke in product(asked.pitch, asked.reach, asked.stroke):
        kept = every
        if asked.printer:
            kept = [one for one in every if prints([one[0]], pitch, reach, stroke, asked.printer)]
        letters, shapes = zip(*kept, strict=True)
        apart, ink = distances(letters, sensor, pitch, reach, stroke)
        apart[[[one == other for other in shapes] for one in shapes]] = 0.0
        found = [best_set(apart, ink, size) for size in asked.letters]
        chosen = [[letters[k] for k in one] for _, one in found if one]
        printed = [
            [str(len(one)) for one in chosen if prints(one, pitch, reach, stroke, printer)]
            for printer in PRINTED
        ]
        runner.row(pitch, reach, stroke, *(near / unit for near, _ in found),
                   *(", ".join(one) or "none" for one in printed))  # fmt: skip
        for one in chosen:
            sets += [f"\n{len(one)} letters, {pitch:g} mm, {reach}, {stroke}", *map(lines, one)]
    for name in SHIPPED:
        near = (f"{near_of(name, pitch) / unit:.3g} at {pitch:g} mm" for pitch in asked.pitch)
        print(f"{name}: {', '.join(near)}")
    print("\n".join(sets))


if __name__ == "__main__":
    main()
