"""The application: the page, its live line, and the requests of `routes`.

    GET   /                          the page        /static/...
    WS    /live                      frames, mosaics (bytes) and topics (JSON); takes {"filter"}

What is refused is `{"error": {"cause", "fix", "place", ...}}`.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from importlib import resources
from pathlib import Path

from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.middleware.gzip import GZipMiddleware

from encoded_objects.base.errors import EncodedObjectsError
from recognizer.bench.broker import Broker, Subscriber
from recognizer.bench.message import FILTERS
from recognizer.bench.routes import Ports, api_routes
from recognizer.bench.session import Session

_BAD, _FULL = 1008, 1013  # codes of a line that is closed
PAGES = 80  #: open at once; 64 that never read leave room for those that do
MESSAGE = 1024  #: bytes of a message from a page
FILTER_S = 0.02  #: between two messages of a page, each of which costs an image


def application(session: Session, broker: Broker, ports: Ports, parts: Path | None) -> FastAPI:
    """Return the application of a session; `ports` and `parts` as for `routes.api_routes`."""

    @contextlib.asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        broker.attach(asyncio.get_running_loop())
        yield
        broker.attach(None)

    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None, lifespan=lifespan)
    app.add_middleware(GZipMiddleware, minimum_size=4096)
    app.add_exception_handler(EncodedObjectsError, _error_response)
    app.add_exception_handler(RequestValidationError, _invalid_response)
    app.include_router(api_routes(session, ports, parts))
    page = Path(str(resources.files("recognizer.bench").joinpath("static")))
    app.mount("/static", StaticFiles(directory=page), name="static")

    @app.get("/")
    def index() -> Response:
        return FileResponse(page / "index.html")

    @app.websocket("/live")
    async def live(line: WebSocket) -> None:
        await line.accept()
        if len(broker.subscribers) >= PAGES:
            await line.close(_FULL, f"{PAGES} pages are open already")
            return
        await _send_news(line, broker)

    return app


async def _send_news(line: WebSocket, broker: Broker) -> None:
    """Send a page all news until it leaves."""
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
    except (WebSocketDisconnect, RuntimeError):  # it left while something was sent
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
        await asyncio.sleep(FILTER_S)


def _filter_name(text: str) -> str | None:
    if len(text) > MESSAGE:
        return None
    try:
        wish = json.loads(text)
    except ValueError:
        return None
    name = wish.get("filter") if isinstance(wish, dict) else None
    return name if name in FILTERS else None


async def _error_response(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, EncodedObjectsError)
    return JSONResponse({"error": error.as_json()}, status_code=getattr(error, "status", 400))


async def _invalid_response(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])
    fix = "see recognizer.bench.routes"
    values = {"cause": f"{where}: {first['msg']}", "fix": fix, "place": ""}
    return JSONResponse({"error": values}, status_code=422)
