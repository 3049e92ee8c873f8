"""What the database holds, as requests: objects, the array, files of the parts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import FileResponse

from generator.database.open import open_database
from generator.database.read import object_entry, read_object, read_parts
from generator.database.transaction import read_transaction
from recognizer.bench.errors import BusyError, UnknownError
from recognizer.bench.example import make_example
from recognizer.bench.files import part_folder, part_to_send
from recognizer.bench.lab_json import arrays_json, map_json, object_json, objects_json
from recognizer.bench.picture import object_svg
from recognizer.bench.promise import face_promises
from recognizer.bench.session import Session
from recognizer.bench.settings import DATABASE
from recognizer.bench.simulated import SCHEME

LAB = "lab.db"  #: in the folder where the bench was started, where no database was named
KEPT = {"cache-control": "private, max-age=86400"}  #: its address tells when it was registered


def lab_routes(session: Session, parts: Path | None) -> APIRouter:
    """Return the routes; files are sent from the folder `parts`, or the database's, alone."""
    routes = APIRouter(prefix="/api")

    def engine() -> Any:
        if not session.database:
            raise UnknownError("no database is open", fix="start with --database lab.db")
        return open_database(session.database, writable=False, wait_s=DATABASE.wait_s)

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
        name = make_example(Path.cwd(), session.database or LAB)
        session.use_database(session.database or LAB)
        session.open(SCHEME)
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
        session.recognition.reload()
        if session.simulation is not None:
            session.simulation.forget()
        return {"reloading": True}

    @routes.get("/map/{number}")
    def array(number: int) -> dict[str, Any]:
        reader = session.recognition.reader
        known = () if reader is None else reader.lab.arrays
        if not 0 <= number < len(known):
            raise UnknownError(f"there is no array {number}", fix=f"there are {len(known)}")
        with read_transaction(engine()) as connection:
            return map_json(connection, known[number])

    return routes
