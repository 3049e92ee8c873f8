"""The touches of the session as requests: list, image, name, table, recording."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from probe.recording.record import Recorder
from recognizer.bench.errors import BusyError
from recognizer.bench.session import Session
from recognizer.bench.settings import TOUCHES


class NameRequest(BaseModel):
    """How a touch is called."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(max_length=TOUCHES.name)


def touch_routes(session: Session) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/api")
    log = session.recognition.touches

    @routes.get("/touches")
    def touches() -> dict[str, Any]:
        return {"touches": log.all(), "newest": log.newest}

    @routes.get("/touches/{number}")
    def one(number: int) -> dict[str, Any]:
        return log.one(number)

    @routes.post("/touches/{number}")
    def rename(number: int, body: NameRequest) -> dict[str, Any]:
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

    return routes


def _download(content: bytes, name: str, media_type: str) -> Response:
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type=media_type, headers=headers)
