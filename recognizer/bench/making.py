"""The requests that make parts: what can be made, what it would be, a zip of its files."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar
from urllib.parse import quote

from fastapi import APIRouter, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse
from pydantic import BaseModel, ConfigDict, Field

from encoded_objects.base.errors import without_password
from recognizer.bench.encode_object import LOOK_S, load_ahead, make_part, part_settings, try_part
from recognizer.bench.options import LAB
from recognizer.bench.session import Session

_Made = TypeVar("_Made")

PIECE = 1 << 16  #: bytes of a zip that are sent at once


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(max_length=200)
    spec: str = Field(max_length=32_000)  #: YAML
    keep: bool  #: in the lab that is open, or a new one; otherwise in one of its own


def add_making_routes(routes: APIRouter, session: Session) -> None:
    """Add the requests; a part that is kept goes into the lab that is open, or a new one."""

    def lab_of(body: _Part) -> str:
        return (session.database or LAB) if body.keep else ""

    @routes.get("/make")
    def settings() -> dict[str, Any]:
        schema = part_settings()
        load_ahead()
        lab = without_password(session.database or LAB)
        return {
            "schema": schema, "sensor_type": session.sensor.name,
            "lab": lab.removeprefix("sqlite:///"), "new": not session.database,
        }  # fmt: skip

    @routes.post("/make/try")
    async def attempt(body: _Part, request: Request) -> dict[str, Any]:
        return await _while_there(
            request, lambda gone: try_part(body.spec, body.name, lab_of(body), gone)
        )

    @routes.post("/make")
    async def make(body: _Part, request: Request) -> StreamingResponse:
        name, made, packed = await _while_there(
            request, lambda gone: make_part(body.spec, body.name, lab_of(body), gone)
        )
        if body.keep:
            await run_in_threadpool(session.read_again)
        headers = {
            "content-disposition": f'attachment; filename="{name}.zip"',
            "content-length": str(os.fstat(packed.fileno()).st_size),
            "x-object": quote(made),
        }
        chunks = iter(lambda: packed.read(PIECE), b"")
        return StreamingResponse(chunks, media_type="application/zip", headers=headers)


async def _while_there(request: Request, work: Callable[[Callable[[], bool]], _Made]) -> _Made:
    """Do work in a thread, and tell it when the page that waits for it has left."""
    gone = threading.Event()
    doing = asyncio.ensure_future(run_in_threadpool(work, gone.is_set))
    while not (await asyncio.wait({doing}, timeout=LOOK_S))[0]:
        if await request.is_disconnected():
            gone.set()
    return doing.result()
