"""Board of the probe: parts list, connections, wiring picture.

Rows are driven by shift registers, columns read through a multiplexer and a load resistor: the
grounded board of `probe/firmware/README.md`. It has 16 x 16 lines at most; larger matrices are read
by boards of their makers.
"""

from __future__ import annotations

import itertools
import math
from html import escape
from typing import NamedTuple

from encoded_objects.base.sensor_type import SensorType
from probe.kit import sizes
from probe.kit.sizes import KitSizes

LINES_MAX = 16  #: rows or columns of the board
LOAD_OHM = 1000  #: of film of 100 uS / N under 20 to 120 N (docs/probe.md, "Which load resistor")

Connection = tuple[str, str, str, str]  # from, its pin, to, its pin


class Item(NamedTuple):
    """A line of the parts list."""

    what: str
    value: str
    quantity: str
    use: str


def has_board(sensor: SensorType) -> bool:
    """Whether our board reads a type."""
    return sensor.value != "depth" and max(sensor.shape) <= LINES_MAX


def electric_items(sensor: SensorType) -> list[Item]:
    """Return the parts of the board."""
    if not has_board(sensor):
        return []
    registers = math.ceil(sensor.rows / 8)
    return [
        Item("Arduino Uno R3, or Nano", "ATmega328P, 16 MHz", "1", "firmware, USB"),
        Item("shift register", "74HC595, DIP-16", str(registers), "drives the rows"),
        Item("analog multiplexer", "CD74HC4067, on a breakout", "1", "selects the column"),
        Item("load resistor", f"{LOAD_OHM:g} ohm, 1 %, metal film", "1", "column to ground"),
        Item("capacitor", "100 nF, ceramic", str(registers + 2), "supply of each chip; AREF"),
        Item("capacitor", "10 uF, 10 V", "1", "supply of the board"),
        Item("connector for the film's tail", f"{sensor.rows + sensor.columns} contacts, its pitch",
             "1", "rows and columns"),
        Item("ribbon cable", f"{sensor.rows + sensor.columns} wires, 300 mm at most", "1",
             "sensor to board"),
        Item("cable tie", "2.5 mm wide", "2", "strain relief on the tongue"),
    ]  # fmt: skip


def mechanical_items(k: KitSizes) -> list[Item]:
    """Return the mechanical parts and the material of the overlay."""
    overlay, litres = k.sensor.overlay, 1.3 * k.silicone_mm3 / 1000
    shore = shore_a(overlay.young_mpa)
    found = [
        Item("two-part silicone", f"Shore A {shore:.0f} (E = {overlay.young_mpa:g} MPa)",
             f"{litres:.1f} ml", "the overlay, a third more than it holds"),
        Item("release spray for silicone", "", "a little", "mould"),
        Item("dowel pin", f"{sizes.PIN_MM:g} x 20 mm", "2", "mould"),
        Item("screw and nut", "M3 x 25", "4", "mould"),
        Item("screw", "M3 x 30, socket head, with nut", "4", "frame, body, adapter"),
        Item("foam sheet", f"EVA, {sizes.FOAM_MM:g} mm",
             f"{2 * k.sensor.half_mm[0]:.0f} x {2 * k.sensor.half_mm[1]:.0f} mm",
             "under the foot of the cap"),
        Item("screw", "M6 x 16, socket head", "4", "robot flange ISO 9409-1-50-4-M6"),
        Item("weights", "100 g to 10 kg", "5", "calibration"),
    ]  # fmt: skip
    if k.sensor.value != "depth":
        s = k.sensor
        found.insert(0, Item("film", f"{s.rows} x {s.columns} tactels, {s.step_mm[0]:g} x "
                             f"{s.step_mm[1]:g} mm apart", "1", "the sensor"))  # fmt: skip
    return found


def shore_a(young_mpa: float) -> float:
    """Return the hardness of an elastomer after Gent (1958), from its Young's modulus.

    Examples
    --------
    >>> round(shore_a(1.0), 1)
    26.8
    """
    a = young_mpa * 0.137505 / 0.0981
    return (254 * a - 56) / (7.62336 + 2.54 * a)


def connections(sensor: SensorType) -> list[Connection]:
    """Return every wire of the board, Arduino Uno."""
    registers = [f"U{k + 1}" for k in range(math.ceil(sensor.rows / 8))]
    found: list[Connection] = [
        ("Uno", "D8", registers[0], "SER"),
        *(("Uno", "D9", one, "SRCLK") for one in registers),
        *(("Uno", "D10", one, "RCLK") for one in registers),
        *((one, "QH'", after, "SER") for one, after in itertools.pairwise(registers)),
        *((one, f"Q{'ABCDEFGH'[pin]}", "film", f"row {8 * k + pin}")
          for k, one in enumerate(registers) for pin in range(min(8, sensor.rows - 8 * k))),
        *(("Uno", f"D{4 + bit}", "MUX", f"S{bit}") for bit in range(4)),
        *(("MUX", f"C{c}", "film", f"column {c}") for c in range(sensor.columns)),
        ("Uno", "A0", "MUX", "SIG"),
        ("R1", "1", "MUX", "SIG"),
        ("Uno", "GND", "R1", "2"),
    ]  # fmt: skip
    for one in (*registers, "MUX"):
        found += [("Uno", "5V", one, "VCC"), ("Uno", "GND", one, "GND")]
    for one in registers:
        found += [("Uno", "5V", one, "SRCLR"), ("Uno", "GND", one, "OE")]
    return [*found, ("Uno", "GND", "MUX", "EN")]


_COLUMNS_PX = {"Uno": 30, "U1": 300, "U2": 300, "MUX": 300, "R1": 30, "film": 680}  #: left sides
_COLOURS = {"row": "#2563EB", "column": "#059669", "D": "#7C3AED", "SIG": "#B45309"}
_STEP, _WIDE = 17, 150  #: of pins, and of boxes, px
_TITLES = {"U1": "U1 74HC595", "U2": "U2 74HC595", "MUX": "U3 CD74HC4067", "Uno": "Arduino Uno",
           "R1": f"R1 {LOAD_OHM:g} ohm", "film": "film"}  # fmt: skip
_RAILS = {"5V": "+5 V", "GND": "ground"}


def wiring_svg(sensor: SensorType) -> str:
    """Return the wiring picture: a box for each part, a line for each wire, its pins named.

    Supply and ground are written at the pins that take them.
    """
    drawn = _Drawing()
    wires = connections(sensor)
    signals = [wire for wire in wires if wire[1] not in _RAILS and wire[3] not in _RAILS]
    rails = [(part, pin, rail) for a, p, b, q in wires
             for part, pin, rail in ((b, q, p), (a, p, p)) if rail in _RAILS]  # fmt: skip
    pins: dict[str, list[tuple[str, str]]] = {name: [] for name in ("Uno", "U1", "U2", "MUX", "R1",
                                                                    "film")}  # fmt: skip
    for part, pin in [end for a, p, b, q in signals for end in ((a, p), (b, q))]:
        pins[part].append((pin, ""))
    for part, pin, rail in rails:
        pins[part].append((pin, _RAILS[rail]))
    for part, named in pins.items():
        if named:
            drawn.part(part, list(dict.fromkeys(named)))
    for a, p, b, q in signals:
        drawn.wire((a, p), (b, q))
    return drawn.text()


class _Drawing:
    """Boxes and wires that are drawn already; boxes of a column stand below each other."""

    def __init__(self) -> None:
        self.next: dict[int, int] = {}
        self.pins: dict[tuple[str, str], tuple[float, float, int]] = {}
        self.lanes: dict[tuple[str, str], float] = {}
        self.boxes: list[str] = []
        self.lines: list[str] = []

    def part(self, name: str, pins: list[tuple[str, str]]) -> None:
        """Draw a box with its pins, with the names of their rails."""
        x = _COLUMNS_PX[name]
        y = self.next.get(x, 30)
        right = [pin for pin in pins if _stands_right(name, pin[0])]
        left = [pin for pin in pins if pin not in right]
        high = _STEP * (max(len(left), len(right)) + 1) + 12
        self.next[x] = y + high + 26
        self.boxes += [
            f'<rect x="{x}" y="{y}" width="{_WIDE}" height="{high}" class="part"/>',
            f'<text x="{x + _WIDE / 2}" y="{y + 15}" class="name">{escape(_TITLES[name])}</text>',
        ]
        for side, named in ((-1, left), (1, right)):
            for number, (pin, rail) in enumerate(named):
                at, down = x + (_WIDE if side > 0 else 0), y + 34 + _STEP * number
                self.pins[name, pin] = (at, down, side)
                ends = ("end", "start") if side > 0 else ("start", "end")
                self.boxes.append(f'<text x="{at - 5 * side}" y="{down + 4}" '
                                  f'text-anchor="{ends[0]}">{escape(pin)}</text>')  # fmt: skip
                if rail:
                    self.boxes.append(
                        f'<path d="M{at},{down}h{8 * side}" stroke="#64748B"/><text '
                        f'x="{at + 11 * side}" y="{down + 4}" text-anchor="{ends[1]}" '
                        f'class="rail">{rail}</text>'
                    )

    def wire(self, start: tuple[str, str], end: tuple[str, str]) -> None:
        """Draw a wire: out of a pin, down a lane that its net has for itself, into the other."""
        (x0, y0, out), (x1, y1, _) = self.pins[start], self.pins[end]
        if start not in self.lanes:
            taken = sum(self.pins[one][0] == x0 for one in self.lanes)
            self.lanes[start] = x0 + out * (24 + 5.5 * taken)
        name = f"{start[0]} {start[1]} - {end[0]} {end[1]}"
        self.lines.append(
            f'<path d="M{x0},{y0}H{self.lanes[start]:.1f}V{y1}H{x1}" '
            f'stroke="{_colour(start[1], end[1])}"><title>{escape(name)}</title></path>'
        )

    def text(self) -> str:
        """Return the picture."""
        high = max(self.next.values())
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 860 {high}" '
            'font-family="Helvetica,Arial,sans-serif" font-size="11">'
            "<style>.part{fill:#F8FAFC;stroke:#334155}.name{font-weight:bold;text-anchor:middle}"
            ".rail{fill:#64748B;font-size:9px}path{fill:none;stroke-width:1.2}</style>"
            f"{''.join(self.lines)}{''.join(self.boxes)}</svg>\n"
        )


def _stands_right(part: str, pin: str) -> bool:
    """Return whether a pin stands on the right side of its box: towards what it goes to."""
    if part in ("Uno", "R1") or (part, pin) == ("U2", "SER"):  # that follows U1
        return True
    return pin.startswith(("Q", "C")) and part != "film"


def _colour(one: str, other: str) -> str:
    for pin in (other, one):
        for start, colour in _COLOURS.items():
            if pin.startswith(start):
                return colour
    return "#64748B"
