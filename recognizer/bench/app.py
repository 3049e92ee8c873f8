"""The routes of the bench: the page, the live line, the work, objects and files.

    GET   /                          the page        /static/...
    WS    /live                      frames, mosaics (bytes) and topics (JSON); takes {"filter"}
    GET   /api/bench                 what there is: ports, sensor, arrays
    POST  /api/port | sensor | bias | record | replay | calibration | mosaic | lab
    POST  /api/touch | load | unplug                            the simulated probe
    GET   /api/objects[/NAME[/parts/N]], /api/map/N             what is registered
    GET   /api/recordings/NAME, /api/timeline, /api/frame.csv   POST /api/recordings?name=

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

from encoded_objects.errors import EncodedObjectsError
from recognizer.bench.bulletin import Bulletin, Reader
from recognizer.bench.holdings import holdings_routes
from recognizer.bench.images import FILTERS
from recognizer.bench.session import Session
from recognizer.bench.work import work_routes

PAGES = 64  #: open at once
WISH = 1024  #: bytes of a message from a page
_BAD, _FULL = 1008, 1013  # codes of a line that is closed


@dataclass(frozen=True, slots=True)
class Bench:
    """What the routes work on."""

    session: Session
    bulletin: Bulletin
    parts: Path | None  #: folder of the files that may be downloaded
    ports: tuple[tuple[str, str], ...]  #: URLs and labels that are always offered


def app_for(bench: Bench) -> FastAPI:
    """Return the application."""

    @contextlib.asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        bench.bulletin.attach(asyncio.get_running_loop())
        yield
        bench.bulletin.attach(None)

    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None, lifespan=lifespan)
    app.add_middleware(GZipMiddleware, minimum_size=4096)
    app.add_exception_handler(EncodedObjectsError, _refused)
    app.add_exception_handler(RequestValidationError, _malformed)
    app.include_router(work_routes(bench.session, bench.ports))
    app.include_router(holdings_routes(bench.session, bench.parts))
    page = Path(str(resources.files("recognizer.bench").joinpath("static")))
    app.mount("/static", StaticFiles(directory=page), name="static")

    @app.get("/")
    def index() -> Response:
        return FileResponse(page / "index.html")

    @app.websocket("/live")
    async def live(line: WebSocket) -> None:
        await line.accept()
        if len(bench.bulletin.readers) >= PAGES:
            await line.close(_FULL, f"{PAGES} pages are open already")
            return
        await _serve(line, bench.bulletin)

    return app


async def _serve(line: WebSocket, bulletin: Bulletin) -> None:
    """Tell a page the news until it leaves."""
    reader = Reader()
    reader.news.set()
    bulletin.readers.add(reader)
    listening = asyncio.create_task(_listen(line, reader))
    listening.add_done_callback(lambda _: reader.news.set())
    try:
        while True:
            await reader.news.wait()
            reader.news.clear()
            if listening.done():
                break
            for message in bulletin.news(reader):
                if isinstance(message, bytes):
                    await line.send_bytes(message)
                else:
                    await line.send_text(message)
    except (WebSocketDisconnect, RuntimeError):  # it left while it was being told
        pass
    finally:
        bulletin.readers.discard(reader)
        listening.cancel()


async def _listen(line: WebSocket, reader: Reader) -> None:
    """Take a page's wishes; end when it leaves or talks nonsense."""
    while True:
        try:
            text = await line.receive_text()
        except (WebSocketDisconnect, KeyError):  # KeyError: bytes
            return
        wish = _wish(text)
        if wish is None:
            await line.close(_BAD, f"give a filter: {', '.join(FILTERS)}")
            return
        reader.wish = wish
        reader.seen.pop("frame", None)
        reader.news.set()


def _wish(text: str) -> str | None:
    if len(text) > WISH:
        return None
    try:
        said = json.loads(text)
    except ValueError:
        return None
    wish = said.get("filter") if isinstance(said, dict) else None
    return wish if wish in FILTERS else None


async def _refused(_request: Request, error: Exception) -> JSONResponse:
    told: dict[str, Any] = {
        "cause": getattr(error, "cause", str(error)),
        "fix": getattr(error, "fix", ""),
        "place": getattr(error, "place", ""),
    }
    return JSONResponse({"error": told}, status_code=getattr(error, "status", 400))


async def _malformed(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])
    told = {"cause": f"{where}: {first['msg']}", "fix": "see recognizer.bench.work", "place": ""}
    return JSONResponse({"error": told}, status_code=422)
