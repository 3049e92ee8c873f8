"""The requests that pages can make; bodies are JSON, and unknown names in them are refused.

GET   /api/bench                 what there is: ports, sensor, arrays
GET   /api/clock                 its clock, for pages on machines with another
POST  /api/port | sensor | bias | record | replay | calibration | mosaic | lab
POST  /api/scan | flip | mounting | learned | as-built
POST  /api/touch[/next] | load | unplug                          the simulated probe
GET   /api/make                  what can be made: the schema of specs
POST  /api/make[/try]            a zip of all files of a spec; or what it would be
GET   /api/objects[/NAME[/picture.svg|/parts/N]], /api/promise/NAME, /api/map/N
GET   /api/mosaics/NAME[/FACE]                              the mosaics of its faces
GET   /api/recordings/NAME, /api/timeline, /api/frame.csv   POST /api/recordings?name=
GET   /api/touches[/N], /api/touches.csv, /api/touches.h5   POST, DELETE /api/touches/N
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from encoded_objects.base.errors import without_password
from encoded_objects.base.sensor_type import usual_force_n
from generator.database.open import open_database
from generator.database.read import object_entry, read_object, read_parts
from generator.database.transaction import read_transaction
from probe.port.listing import list_ports
from probe.recording.record import Recorder
from recognizer.bench import controllers
from recognizer.bench.encode_object import EXAMPLE, face_promises, make_part
from recognizer.bench.errors import BusyError, UnknownError
from recognizer.bench.files import Uploads, find_file, part_folder, part_to_send
from recognizer.bench.lab_json import arrays_json, map_json, object_json, object_svg, objects_json
from recognizer.bench.making import add_making_routes
from recognizer.bench.message import FILTERS
from recognizer.bench.options import LAB
from recognizer.bench.session import Session
from recognizer.bench.touch_log import NAME_LENGTH
from recognizer.touch.options import DEFAULTS

Ports = tuple[tuple[str, str], ...]

KEPT = {"cache-control": "private, max-age=86400"}  #: its address holds the time of registration
DATABASE_S = 2.0  #: wait for other users of the database; then the page shows who holds it


Name = Annotated[str, Field(max_length=200)]


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Port(_Body):
    url: str = Field(max_length=400)  #: empty: none
    sensor: int | None = Field(default=None, ge=0, le=7)


class _Sensor(_Body):
    sensor: int = Field(ge=0, le=7)  #: of the board


class _Switch(_Body):
    on: bool


class _Replay(_Body):
    name: Name = ""  #: of a recording to play; empty: work on the time line
    playing: bool | None = None
    speed: FiniteFloat | None = None
    at_s: FiniteFloat | None = None


class _Touch(_Body):
    object: Name
    face: Name
    x_mm: FiniteFloat  #: face frame
    y_mm: FiniteFloat
    theta_deg: FiniteFloat = 0.0
    force_n: FiniteFloat | None = None  #: None: as its type takes


class _Load(_Body):
    newtons: FiniteFloat


class _Unplug(_Body):
    seconds: FiniteFloat


class _Calibration(_Body):
    do: Literal["begin", "read", "again", "finish", "cancel", "use"]
    newtons: list[float] = Field(default_factory=list, max_length=64)
    seconds: FiniteFloat = 3.0
    simulated_board: bool = False
    name: Name = ""


class _Flip(_Body):
    changes: str = Field(max_length=100)  #: undone in every image, as `columns,values`


class _Mounting(_Body):
    touch: int  #: placed by hand on a face
    object: Name
    face: Name


class _Learned(_Body):
    do: Literal["learn", "use"]
    name: Name = ""  #: to read by; empty: by the sensor's type alone


class _Print(_Body):
    do: Literal["estimate", "store"]
    after: int = 0  #: touch, from whose successors a print is estimated
    material: str = Field(default="", max_length=80)


class _TouchName(_Body):
    name: str = Field(max_length=NAME_LENGTH)


def api_routes(session: Session, ports: Ports, parts: Path | None) -> APIRouter:
    """Return the routes of a session.

    `ports` are URLs and labels that are always offered, `parts` is the folder of the files that may
    be downloaded; None: the database's.
    """
    routes = APIRouter(prefix="/api")
    _add_session_routes(routes, session, ports)
    _add_sensor_routes(routes, session)
    _add_simulation_routes(routes, session)
    _add_recording_routes(routes, session)
    _add_touch_routes(routes, session)
    _add_lab_routes(routes, session, parts)
    add_making_routes(routes, session)
    return routes


def _add_session_routes(routes: APIRouter, session: Session, ports: Ports) -> None:
    def offered() -> dict[str, tuple[str, str]]:
        """Return URL and label of each port, by the URL as it is shown."""
        there = [(entry.url, f"{entry.device} {entry.vendor} {entry.product}".strip())
                 for entry in list_ports()]  # fmt: skip
        labels = [(url, without_password(label)) for url, label in (*ports, *there)]
        return {without_password(url): (url, label) for url, label in labels}

    @routes.get("/bench")
    def bench() -> dict[str, Any]:
        sensor, reader = session.sensor, session.recognition.reader
        return {
            "ports": [{"url": shown, "label": label} for shown, (_, label) in offered().items()],
            "database": without_password(session.database),
            "folder": str(session.folder),
            "filters": FILTERS,
            "sensor": {
                "rows": sensor.rows, "columns": sensor.columns, "type": sensor.name,
                "pitch_mm": sensor.pitch_mm, "row_pitch_mm": sensor.step_mm[1],
                "overlay": sensor.overlay.kind, "overlay_mm": sensor.overlay.height_mm,
                "force_n": usual_force_n(sensor),
            },
            "margin": (reader.options if reader else DEFAULTS).margin,
        }  # fmt: skip

    @routes.post("/port")
    def port(body: _Port) -> dict[str, Any]:
        url, _ = offered().get(body.url, ("", ""))
        if body.url and not url:
            raise UnknownError(
                f"{body.url[:80]} is none of the ports that are offered",
                fix="choose one from the list, or start open-bench with --port",
            )
        session.open(url, body.sensor)
        return session.as_json()

    @routes.post("/sensor")
    def sensor(body: _Sensor) -> dict[str, Any]:
        session.select(body.sensor)
        return session.as_json()

    @routes.post("/bias")
    def bias(body: _Switch) -> dict[str, Any]:
        session.switch_bias(on=body.on)
        return session.as_json()

    @routes.post("/record")
    def record(body: _Switch) -> dict[str, Any]:
        session.record(on=body.on)
        return session.as_json()

    @routes.post("/replay")
    def replay(body: _Replay) -> dict[str, Any]:
        if body.name:
            session.replay(body.name)
        else:
            session.timeline().play(playing=body.playing, speed=body.speed, at_s=body.at_s)
        return session.as_json()

    @routes.get("/timeline")
    def timeline() -> dict[str, Any]:
        feed = session.timeline()
        return {"seconds": feed.seconds, "strength": feed.overview()}

    @routes.get("/clock")
    def clock() -> dict[str, float]:
        return {"now_ms": time.time() * 1e3}


def _add_sensor_routes(routes: APIRouter, session: Session) -> None:
    prints = controllers.PrintController(session)

    @routes.post("/calibration")
    def calibration(body: _Calibration) -> dict[str, Any]:
        if body.do == "begin":
            controllers.begin_calibration(
                session, body.newtons, body.seconds, simulated_board=body.simulated_board
            )
        elif body.do == "finish":
            return controllers.finish_calibration(session)
        elif body.do == "cancel":
            controllers.cancel_calibration(session)
        elif body.do == "use":
            controllers.use_calibration(session, body.name)
        else:
            with controllers.guide_of(session) as guide:
                guide.read() if body.do == "read" else guide.guide.again()
        return session.as_json()

    @routes.post("/scan")
    def scan(body: _Switch) -> dict[str, Any]:
        session.recognition.scan.switch(on=body.on)
        return {"on": body.on}

    @routes.post("/flip")
    def flip(body: _Flip) -> dict[str, Any]:
        controllers.flip_images(session, body.changes)
        return session.sensor_json()

    @routes.post("/mounting")
    def mounting(body: _Mounting) -> dict[str, Any]:
        return controllers.check_mounting(session, body.touch, body.object, body.face)

    @routes.post("/learned")
    def learned(body: _Learned) -> dict[str, Any]:
        if body.do == "learn":
            controllers.learn_from_touches(session)
        else:
            controllers.use_learned(session, body.name)
        return session.sensor_json()

    @routes.post("/as-built")
    def as_built(body: _Print) -> dict[str, Any]:
        if body.do == "store":
            return prints.store()
        return prints.estimate(body.after, body.material)


def _add_simulation_routes(routes: APIRouter, session: Session) -> None:
    @routes.post("/touch")
    def touch(body: _Touch) -> dict[str, Any]:
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
    def load(body: _Load) -> dict[str, Any]:
        session.simulated().load(body.newtons)
        return {"newtons": body.newtons}

    @routes.post("/unplug")
    def unplug(body: _Unplug) -> dict[str, Any]:
        session.simulated().unplug(body.seconds)
        return {"seconds": body.seconds}


def _add_recording_routes(routes: APIRouter, session: Session) -> None:
    uploads = Uploads(session.folder, lambda: session.ending)

    @routes.get("/recordings/{name}")
    def recording(name: str) -> Response:
        path = find_file(session.folder, name, ".h5")
        return FileResponse(path, filename=name, media_type="application/x-hdf5")

    @routes.post("/recordings")
    async def upload(name: str, request: Request) -> dict[str, Any]:
        frames = await uploads.take(name, request.stream())
        return {"name": name, "frames": frames}

    @routes.get("/frame.csv")
    def frame() -> Response:
        newest, values, unit = session.newest()
        rows = "".join(",".join(f"{value:g}" for value in row) + "\r\n" for row in values)
        return _download(rows.encode(), f"frame-{newest.seq}-{unit}.csv", "text/csv")


def _add_touch_routes(routes: APIRouter, session: Session) -> None:
    log = session.recognition.touches

    @routes.get("/touches")
    def touches() -> dict[str, Any]:
        return {"touches": log.all(), "newest": log.newest}

    @routes.get("/touches/{number}")
    def one(number: int) -> dict[str, Any]:
        return log.one(number)

    @routes.post("/touches/{number}")
    def rename(number: int, body: _TouchName) -> dict[str, Any]:
        return log.rename(number, body.name)

    @routes.delete("/touches/{number}")
    def delete(number: int) -> dict[str, Any]:
        log.delete(number)
        return {"deleted": number}

    @routes.get("/touches.csv")
    def table() -> Response:
        return _download(log.as_csv().encode(), "touches.csv", "text/csv")

    @routes.get("/touches.h5")
    def recording() -> Response:
        frames = log.frames()
        if not frames:
            raise BusyError("nothing was touched yet", fix="touch the part first")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "touches.h5"
            with Recorder(path, sensor=session.sensor_name()) as recorder:
                for frame in sorted(frames, key=lambda one: one.t_ns):
                    recorder.append(frame)
            return _download(path.read_bytes(), path.name, "application/x-hdf5")

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
        return Response(found, media_type="application/octet-stream")


def _add_lab_routes(routes: APIRouter, session: Session, parts: Path | None) -> None:
    def engine() -> Any:
        if not session.database:
            raise UnknownError("no database is open", fix="start with --database lab.db")
        return open_database(session.database, writable=False, wait_s=DATABASE_S)

    @routes.get("/objects")
    def objects() -> dict[str, Any]:
        if not session.database:
            return {"objects": []}
        with read_transaction(engine()) as connection:
            return {"objects": objects_json(connection)}

    @routes.post("/example")
    def example() -> dict[str, Any]:
        if session.database and objects()["objects"]:
            raise BusyError("objects are registered already", fix="touch one of these")
        _, name, packed = make_part(EXAMPLE, "Example", session.database or LAB, lambda: False)
        packed.close()
        session.read_again()
        return {"object": name}

    @routes.get("/objects/{name}")
    def one(name: str) -> dict[str, Any]:
        with read_transaction(engine()) as connection:
            held = object_json(connection, name)
        if session.simulation is not None:
            session.simulation.prepare(name)
        return held

    @routes.get("/objects/{name}/picture.svg")
    def picture(name: str) -> Response:
        with read_transaction(engine()) as connection:
            drawn = object_svg(read_object(connection, name))
        return Response(drawn, media_type="image/svg+xml", headers=KEPT)

    @routes.get("/promise/{name}")
    def promise(name: str) -> dict[str, Any]:
        with read_transaction(engine()) as connection:
            registered = object_entry(connection, name).utc
        return {"faces": face_promises(session.database, name, registered, session.sensor)}

    @routes.get("/objects/{name}/parts/{number}")
    def part(name: str, number: int) -> FileResponse:
        with read_transaction(engine()) as connection:
            known = read_parts(connection, object_entry(connection, name).object_id)
        if not 0 <= number < len(known):
            raise UnknownError(f"{name} has no part {number}", fix=f"it has {len(known)}")
        folder = parts or part_folder(session.database)
        path = part_to_send(session.database, folder and folder.resolve(), known[number])
        return FileResponse(path, filename=path.name, media_type="application/octet-stream")

    @routes.get("/lab")
    def lab() -> dict[str, Any]:
        reader = session.recognition.reader
        return {"encodings": [] if reader is None else arrays_json(reader.lab)}

    @routes.post("/lab")
    def reload() -> dict[str, Any]:
        session.read_again()
        return {"reloading": True}

    @routes.get("/map/{number}")
    def array(number: int) -> dict[str, Any]:
        reader = session.recognition.reader
        known = () if reader is None else reader.lab.arrays
        if not 0 <= number < len(known):
            raise UnknownError(f"there is no array {number}", fix=f"there are {len(known)}")
        with read_transaction(engine()) as connection:
            return map_json(connection, known[number])


def _download(content: bytes, name: str, media_type: str) -> Response:
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media_type, headers=headers)
