"""What can be done at the bench, as requests.

Port, sensor, bias, record, replay, calibrate, and what the simulated probe shall do. Bodies
are JSON; unknown names in them are refused.
"""

from __future__ import annotations

import time
from typing import Any, Literal

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field

from encoded_objects.base.sensor_type import usual_force_n
from probe.port.listing import list_ports
from recognizer.bench.errors import UnknownError
from recognizer.bench.files import find_file
from recognizer.bench.images import FILTERS
from recognizer.bench.session import Session
from recognizer.bench.uploads import Uploads
from recognizer.touch.options import DEFAULTS

Ports = tuple[tuple[str, str], ...]


class _Request(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PortRequest(_Request):
    """Which port to read; empty: none."""

    url: str = Field(max_length=400)
    sensor: int | None = Field(default=None, ge=0, le=7)


class SensorRequest(_Request):
    """Which sensor of the board."""

    sensor: int = Field(ge=0, le=7)


class SwitchRequest(_Request):
    """On or off."""

    on: bool


class ReplayRequest(_Request):
    """A recording to play, or what to do on its time line."""

    name: str = Field(default="", max_length=200)
    playing: bool | None = None
    speed: float | None = Field(default=None, allow_inf_nan=False)
    at_s: float | None = Field(default=None, allow_inf_nan=False)


class TouchRequest(_Request):
    """Where the simulated probe shall come down: face frame."""

    object: str = Field(max_length=200)
    face: str = Field(max_length=200)
    x_mm: float = Field(allow_inf_nan=False)
    y_mm: float = Field(allow_inf_nan=False)
    theta_deg: float = Field(default=0.0, allow_inf_nan=False)
    force_n: float | None = Field(default=None, allow_inf_nan=False)  #: None: as its type takes


class LoadRequest(_Request):
    """An even load on the simulated probe."""

    newtons: float = Field(allow_inf_nan=False)


class UnplugRequest(_Request):
    """How long the simulated probe is away."""

    seconds: float = Field(allow_inf_nan=False)


class CalibrationRequest(_Request):
    """A step of a calibration."""

    do: Literal["begin", "read", "again", "finish", "cancel", "use"]
    newtons: list[float] = Field(default_factory=list, max_length=64)
    seconds: float = Field(default=3.0, allow_inf_nan=False)
    simulated_board: bool = False
    name: str = Field(default="", max_length=200)


def control_routes(session: Session, ports: Ports) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/api")
    uploads = Uploads(session.folder, lambda: session.ending)

    def port_list() -> list[dict[str, Any]]:
        there = [(entry.url, f"{entry.device} {entry.vendor} {entry.product}".strip())
                 for entry in list_ports()]  # fmt: skip
        return [{"url": url, "label": label} for url, label in dict([*ports, *there]).items()]

    @routes.get("/bench")
    def bench() -> dict[str, Any]:
        sensor, reader = session.sensor, session.recognition.reader
        return {
            "ports": port_list(),
            "database": session.database,
            "folder": str(session.folder),
            "filters": FILTERS,
            "sensor": {
                "rows": sensor.rows,
                "columns": sensor.columns,
                "pitch_mm": sensor.pitch_mm,
                "row_pitch_mm": sensor.step_mm[1],
                "type": sensor.name,
                "overlay": sensor.overlay.kind,
                "overlay_mm": sensor.overlay.height_mm,
                "force_n": usual_force_n(sensor),
            },
            "margin": (reader.options if reader else DEFAULTS).margin,
        }

    @routes.post("/port")
    def port(body: PortRequest) -> dict[str, Any]:
        if body.url and body.url not in {entry["url"] for entry in port_list()}:
            raise UnknownError(
                f"{body.url[:80]} is none of the ports that are offered",
                fix="choose one from the list, or start open-bench with --port",
            )
        session.open(body.url, body.sensor)
        return session.as_json()

    @routes.post("/sensor")
    def sensor(body: SensorRequest) -> dict[str, Any]:
        session.select(body.sensor)
        return session.as_json()

    @routes.post("/bias")
    def bias(body: SwitchRequest) -> dict[str, Any]:
        session.calibrations.bias(on=body.on)
        return session.as_json()

    @routes.post("/record")
    def record(body: SwitchRequest) -> dict[str, Any]:
        session.record(on=body.on)
        return session.as_json()

    @routes.post("/replay")
    def replay(body: ReplayRequest) -> dict[str, Any]:
        if body.name:
            session.replay(body.name)
        else:
            session.timeline().play(playing=body.playing, speed=body.speed, at_s=body.at_s)
        return session.as_json()

    @routes.get("/timeline")
    def timeline() -> dict[str, Any]:
        feed = session.timeline()
        return {"seconds": feed.seconds, "strength": feed.overview()}

    @routes.post("/touch")
    def touch(body: TouchRequest) -> dict[str, Any]:
        force_n = usual_force_n(session.sensor) if body.force_n is None else body.force_n
        session.simulated().touch(
            body.object, body.face, body.x_mm, body.y_mm, body.theta_deg, force_n
        )
        return {"touched": True}

    @routes.post("/touch/next")
    def touch_next() -> dict[str, Any]:
        session.touch_next()
        return {"touched": True}

    @routes.post("/load")
    def load(body: LoadRequest) -> dict[str, Any]:
        session.simulated().load(body.newtons)
        return {"newtons": body.newtons}

    @routes.post("/unplug")
    def unplug(body: UnplugRequest) -> dict[str, Any]:
        session.simulated().unplug(body.seconds)
        return {"seconds": body.seconds}

    @routes.post("/calibration")
    def calibration(body: CalibrationRequest) -> dict[str, Any]:
        if body.do == "begin":
            session.calibrations.begin(
                body.newtons, body.seconds, simulated_board=body.simulated_board
            )
        elif body.do == "finish":
            return session.calibrations.finish()
        elif body.do == "cancel":
            session.calibrations.cancel()
        elif body.do == "use":
            session.calibrations.use(body.name)
        else:
            with session.calibrations.guide() as guide:
                guide.read() if body.do == "read" else guide.guide.again()
        return session.as_json()

    @routes.post("/mosaic")
    def mosaic() -> dict[str, Any]:
        session.recognition.mosaics.clear()
        return {"cleared": True}

    @routes.get("/mosaics/{name}")
    def mosaics(name: str) -> dict[str, Any]:
        return {"faces": session.recognition.mosaics.touches(name)}

    @routes.get("/mosaics/{name}/{face}")
    def mosaic_of(name: str, face: str) -> Response:
        found = session.recognition.mosaics.picture(name, face)
        if found is None:
            raise UnknownError(f"{name} {face} was not touched yet", fix="touch it first")
        return Response(found.as_bytes(""), media_type="application/octet-stream")

    @routes.get("/recordings/{name}")
    def recording(name: str) -> Response:
        path = find_file(session.folder, name, ".h5")
        return FileResponse(path, filename=name, media_type="application/x-hdf5")

    @routes.post("/recordings")
    async def upload(name: str, request: Request) -> dict[str, Any]:
        frames = await uploads.take(name, request.stream())
        return {"name": name, "frames": frames}

    @routes.get("/clock")
    def clock() -> dict[str, float]:
        return {"now_ms": time.time() * 1e3}

    @routes.get("/frame.csv")
    def frame() -> Response:
        newest, values, unit = session.newest()
        rows = "".join(",".join(f"{value:g}" for value in row) + "\r\n" for row in values)
        name = f"frame-{newest.seq}-{unit}.csv"
        return Response(
            rows,
            media_type="text/csv",
            headers={"content-disposition": f'attachment; filename="{name}"'},
        )

    return routes
