"""The routes of the bench: the page, the live line, the work, objects and files.

    GET   /                          the page        /static/...
    WS    /live                      frames, mosaics (bytes) and topics (JSON); takes {"filter"}
    GET   /api/bench                 what there is: ports, sensor, arrays
    GET   /api/clock                 its clock, for pages on machines with another
    POST  /api/port | sensor | bias | record | replay | calibration | mosaic | lab
    POST  /api/scan | flip | mounting | learned | as-built       (`checks`)
    POST  /api/touch[/next] | load | unplug                          the simulated probe
    GET   /api/objects[/NAME[/picture.svg|/parts/N]], /api/promise/NAME, /api/map/N
    GET   /api/mosaics/NAME[/FACE]                              what was felt of its faces
    GET   /api/recordings/NAME, /api/timeline, /api/frame.csv   POST /api/recordings?name=
    GET   /api/touches[/N], /api/touches.csv, /api/touches.h5   POST, DELETE /api/touches/N

What is refused is `{"error": {"cause", "fix", "place"}}`.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.middleware.gzip import GZipMiddleware

from encoded_objects.base.errors import EncodedObjectsError
from recognizer.bench.broker import Broker, Subscriber
from recognizer.bench.checks import check_routes
from recognizer.bench.control import control_routes
from recognizer.bench.images import FILTERS
from recognizer.bench.lab import lab_routes
from recognizer.bench.session import Session
from recognizer.bench.settings import PAGE
from recognizer.bench.touches import touch_routes

_BAD, _FULL = 1008, 1013  # codes of a line that is closed


@dataclass(frozen=True, slots=True)
class BenchContext:
    """What the routes work on."""

    session: Session
    broker: Broker
    parts: Path | None  #: folder of the files that may be downloaded; None: the database's
    ports: tuple[tuple[str, str], ...]  #: URLs and labels that are always offered


def app_for(bench: BenchContext) -> FastAPI:
    """Return the application."""

    @contextlib.asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        bench.broker.attach(asyncio.get_running_loop())
        yield
        bench.broker.attach(None)

    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None, lifespan=lifespan)
    app.add_middleware(GZipMiddleware, minimum_size=4096)
    app.add_exception_handler(EncodedObjectsError, _error_response)
    app.add_exception_handler(RequestValidationError, _invalid_response)
    app.include_router(control_routes(bench.session, bench.ports))
    app.include_router(check_routes(bench.session))
    app.include_router(lab_routes(bench.session, bench.parts))
    app.include_router(touch_routes(bench.session))
    page = Path(str(resources.files("recognizer.bench").joinpath("static")))
    app.mount("/static", StaticFiles(directory=page), name="static")

    @app.get("/")
    def index() -> Response:
        return FileResponse(page / "index.html")

    @app.websocket("/live")
    async def live(line: WebSocket) -> None:
        await line.accept()
        if len(bench.broker.subscribers) >= PAGE.pages:
            await line.close(_FULL, f"{PAGE.pages} pages are open already")
            return
        await _serve(line, bench.broker)

    return app


async def _serve(line: WebSocket, broker: Broker) -> None:
    """Tell a page the news until it leaves."""
    subscriber = Subscriber()
    subscriber.news.set()
    broker.subscribers.add(subscriber)
    listening = asyncio.create_task(_listen(line, subscriber))
    listening.add_done_callback(lambda _: subscriber.news.set())
    try:
        while True:
            await subscriber.news.wait()
            subscriber.news.clear()
            if listening.done():
                break
            for message in broker.news(subscriber):
                if isinstance(message, bytes):
                    await line.send_bytes(message)
                else:
                    await line.send_text(message)
    except (WebSocketDisconnect, RuntimeError):  # it left while it was being told
        pass
    finally:
        broker.subscribers.discard(subscriber)
        listening.cancel()


async def _listen(line: WebSocket, subscriber: Subscriber) -> None:
    """Take a page's filters; end when it leaves or talks nonsense."""
    while True:
        try:
            text = await line.receive_text()
        except (WebSocketDisconnect, KeyError):  # KeyError: bytes
            return
        name = _filter_name(text)
        if name is None:
            await line.close(_BAD, f"give a filter: {', '.join(FILTERS)}")
            return
        subscriber.filter_name = name
        subscriber.seen.pop("frame", None)
        subscriber.news.set()


def _filter_name(text: str) -> str | None:
    if len(text) > PAGE.message:
        return None
    try:
        said = json.loads(text)
    except ValueError:
        return None
    name = said.get("filter") if isinstance(said, dict) else None
    return name if name in FILTERS else None


async def _error_response(_request: Request, error: Exception) -> JSONResponse:
    values: dict[str, Any] = {
        "cause": getattr(error, "cause", str(error)),
        "fix": getattr(error, "fix", ""),
        "place": getattr(error, "place", ""),
    }
    return JSONResponse({"error": values}, status_code=getattr(error, "status", 400))


async def _invalid_response(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])
    values = {
        "cause": f"{where}: {first['msg']}",
        "fix": "see recognizer.bench.control",
        "place": "",
    }
    return JSONResponse({"error": values}, status_code=422)
