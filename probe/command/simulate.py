"""`probe-sensor simulate TARGET`: touches of the files that were printed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from encoded_objects.base.console import Action
from probe.command.options import Json, Replace, Typed

if TYPE_CHECKING:
    from probe.simulate.scan import ScanKind

EPILOG = """TARGET is a written part, [bold]out/cube/Cube-F1.stl[/] (with [bold]@lab.db[/]: in the \
frame of its face), a registered face, [bold]lab.db#Cube/F1[/], or [bold]washer[/]. x and y lie \
in the frame of the face: origin at its first vertex, x along its first edge.
"""

_Mm = Annotated[
    float | None, typer.Option(show_default=False, help="Place of the sensor's centre, mm; the "
                                                        "middle, or anywhere with --touches."),
]  # fmt: skip


def simulate(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", show_default=False, help="What is touched."),
    ],
    x: _Mm = None,
    y: _Mm = None,
    theta: Annotated[
        float | None, typer.Option(show_default=False, help="Turn of the sensor, degrees; 0, or "
                                                            "any with --touches."),
    ] = None,
    force: Annotated[
        float | None, typer.Option(min=0.0, show_default=False,
                                   help="Force, N; 80, or 20 ... 120 with --touches, on fsr-16; "
                                        "on another type as hard."),
    ] = None,
    tilt_x: Annotated[
        float | None, typer.Option(show_default=False, help="Tilt about the sensor's x, degrees; "
                                                            "0, or up to 2 with --touches."),
    ] = None,
    tilt_y: Annotated[
        float | None, typer.Option(show_default=False, help="The same about y."),
    ] = None,
    sensor_type: Typed = "",
    overlay: Annotated[
        str, typer.Option(metavar="tab|pad", show_default=False,
                          help="Elastic overlay; that of the sensor type."),
    ] = "",
    accuracy: Annotated[
        str, typer.Option(help="auto, a level of the contact model (footprint, tabs, layer, "
                               "elements), or the largest error, as 0.01."),
    ] = "auto",
    noise: Annotated[
        str, typer.Option(metavar="typical|quiet", help="Noise of contacts and board."),
    ] = "typical",
    touches: Annotated[
        int | None, typer.Option(min=1, show_default=False,
                                 help="So many touches at random; what is given is kept. "
                                      "With --scan: so many of its way, all by default."),
    ] = None,
    scan: Annotated[
        str | None, typer.Option(metavar="raster|kinesthetic", show_default=False,
                                 help="Touches side by side on a way over the face, with the pose "
                                      "of each: as it is, or as an arm with play believes."),
    ] = None,
    frames: Annotated[int, typer.Option(min=1, help="Frames of each touch, 220 a second.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Of places and noise.")] = 0,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.h5", show_default=False,
                                  help="Recording to write."),
    ] = None,
    png: Annotated[
        Path | None, typer.Option(metavar="FILE", show_default=False,
                                  help="Picture of the first touch: surface and image."),
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="FILE", show_default=False,
                                  help="JSON file of where every touch was; it is nowhere else."),
    ] = None,
    replace: Replace = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Touch a part in simulation: a recording as the probe would give it, and a picture."""

    def action() -> int:
        from probe.command.simulated import check_outputs, simulate_touches
        from probe.simulate.simulation import SimulatedProbe, TouchOptions

        if overlay not in ("", "tab", "pad"):
            raise typer.BadParameter(f"--overlay {overlay}: give tab or pad")
        if noise not in ("typical", "quiet"):
            raise typer.BadParameter(f"--noise {noise}: give typical or quiet")
        if scan not in (None, "raster", "kinesthetic"):
            raise typer.BadParameter(f"--scan {scan}: give raster or kinesthetic")
        check_outputs(output, png, truth, replace=replace)
        kind = cast("ScanKind | None", scan)
        options = TouchOptions(x, y, theta, force, tilt_x, tilt_y, touches, frames, seed, kind)
        probe = SimulatedProbe(
            target, options, sensor_type=sensor_type, overlay=overlay, accuracy=accuracy,
            noise="quiet" if noise == "quiet" else "typical",
        )  # fmt: skip
        return simulate_touches(probe, output=output, png=png, truth=truth, as_json=as_json)

    return action
