"""Scan, mounting, what is learned of the sensor, and how a part was printed, as requests."""

from __future__ import annotations

from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, Field

from recognizer.bench.control import SwitchRequest
from recognizer.bench.print_check import PrintCheck
from recognizer.bench.session import Session


class _Request(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class FlipRequest(_Request):
    """Changes that are undone in every image, as `columns,values`; empty: none."""

    changes: str = Field(max_length=100)


class MountingRequest(_Request):
    """A touch that was placed by hand on a face."""

    touch: int
    object: str = Field(max_length=200)
    face: str = Field(max_length=200)


class LearnedRequest(_Request):
    """Learn the sensor, or read by what was learned; an empty name: by its type alone."""

    do: Literal["learn", "use"]
    name: str = Field(default="", max_length=200)


class PrintRequest(_Request):
    """Estimate a print from the touches after one, or keep the estimate."""

    do: Literal["estimate", "store"]
    after: int = 0
    material: str = Field(default="", max_length=80)


def check_routes(session: Session) -> APIRouter:
    """Return the routes."""
    routes = APIRouter(prefix="/api")
    prints = PrintCheck(session)

    @routes.post("/scan")
    def scan(body: SwitchRequest) -> dict[str, Any]:
        session.recognition.scan.switch(on=body.on)
        return {"on": body.on}

    @routes.post("/flip")
    def flip(body: FlipRequest) -> dict[str, Any]:
        session.desk.flip(body.changes)
        return session.desk.as_json()

    @routes.post("/mounting")
    def mounting(body: MountingRequest) -> dict[str, Any]:
        return session.desk.mounting(body.touch, body.object, body.face)

    @routes.post("/learned")
    def learned(body: LearnedRequest) -> dict[str, Any]:
        if body.do == "learn":
            session.desk.learn()
        else:
            session.desk.use(body.name)
        return session.desk.as_json()

    @routes.post("/as-built")
    def as_built(body: PrintRequest) -> dict[str, Any]:
        if body.do == "store":
            return prints.store()
        return prints.estimate(body.after, body.material)

    return routes
