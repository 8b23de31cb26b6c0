"""The server of `simgap open`: on this machine only, every address below a secret that the browser is started with."""

from __future__ import annotations

import secrets
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import cache
from pathlib import Path

import msgspec
import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response
from starlette.routing import Mount, Route

from simgap.app import worker
from simgap.app.desk import LARGEST, Desk, OpenRecord
from simgap.app.guard import Guard
from simgap.app.jobs import Job
from simgap.app.orders import Settings
from simgap.app.pages import HERE, page
from simgap.records import UnusableInput

HOST = "127.0.0.1"
DOWNLOADS = {  # address, file, name to save it under
    "model": (worker.MODEL, "{}.simgap"),
    "page": (worker.PAGE, "{}_diagnosis.html"),
    "json": (worker.ANSWER, "{}_diagnosis.json"),
    "text": (worker.TEXT, "{}_diagnosis.txt"),
}
GONE = "This record is no longer open: it was closed, or simgap open was ended since."


class Server:
    """The page on one port. `address` is where it stands; `run` returns when it is ended."""

    def __init__(self, port: int = 0, source: str = "", said: Settings | None = None) -> None:
        """Take the port, 0 for any that is free, and open the source if one is given. Raises OSError."""
        self.socket = socket.create_server((HOST, port))
        self.desk = Desk()
        secret = secrets.token_urlsafe(16)
        self.address = f"http://{HOST}:{self.socket.getsockname()[1]}/{secret}/"
        if source:
            self.address += f"records/{self.desk.add(source, said).key}/"
        self.app = application(self.desk, secret)

    def run(self) -> None:
        """Serve until Ctrl-C or SIGTERM, then delete what was uploaded."""
        config = uvicorn.Config(
            self.app, log_level="error", access_log=False, lifespan="on", server_header=False, ws="none",
            timeout_graceful_shutdown=1,
        )  # fmt: skip
        uvicorn.Server(config).run(sockets=[self.socket])


def application(desk: Desk, secret: str) -> Starlette:
    """Make the application over a desk, which is cleared when the server ends."""

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        yield
        await desk.close()

    def of(handler: Callable[[Request, Desk, OpenRecord], Awaitable[Response]]):
        """Look up the record of an address for its handler; what cannot be used is answered in one sentence."""

        async def handle(request: Request) -> Response:
            record = desk.records.get(request.path_params["key"])
            if record is None:
                return HTMLResponse(page("gone.html", root="../../", sentence=GONE), 404)
            try:
                return await handler(request, desk, record)
            except UnusableInput as refusal:
                return JSONResponse({"refused": str(refusal)}, 400)

        return handle

    async def new(_: Request) -> Response:
        return JSONResponse({"key": desk.add().key})

    one = "/records/{key}/"
    routes = [
        Route("/", _start),
        Route("/assets/{name}", _asset),
        Route("/records", new, methods=["POST"]),
        Route(one, of(_record)),
        Route(one, of(_close), methods=["DELETE"]),
        Route(one + "files/{path:path}", of(_receive), methods=["PUT"]),
        Route(one + "diagnoses", of(_diagnose), methods=["POST"]),
        Route(one + "{number:int}/", of(_diagnosis)),
        Route(one + "{number:int}/state", of(_state)),
        Route(one + "{number:int}/stop", of(_stop), methods=["POST"]),
        Route(one + "{number:int}/{what}", of(_download)),
    ]
    guards = [Middleware(Guard), Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])]
    return Starlette(routes=[Mount(f"/{secret}", routes=routes)], middleware=guards, lifespan=lifespan)


async def _start(_: Request) -> Response:
    return HTMLResponse(page("start.html", root="", largest=LARGEST))


async def _asset(request: Request) -> Response:
    text = assets().get(request.path_params["name"])
    kind = "text/css" if request.path_params["name"].endswith(".css") else "text/javascript"
    return Response("", 404) if text is None else Response(text, media_type=kind, headers={"Cache-Control": "private"})


@cache
def assets() -> dict[str, str]:
    """The files that the pages share: their own, the style of the site, and plotly.js."""
    from plotly.offline import get_plotlyjs

    import simgap.reports.site

    own = {file.name: file.read_text(encoding="utf-8") for file in (HERE / "assets").iterdir()}
    style = Path(simgap.reports.site.__path__[0]) / "assets" / "site.css"
    return {**own, "site.css": style.read_text(encoding="utf-8"), "plotly.js": get_plotlyjs()}


async def _record(_: Request, __: Desk, record: OpenRecord) -> Response:
    seen = await record.look()
    if seen.look is None:
        return HTMLResponse(page("gone.html", root="../../", sentence=seen.refused))
    curves = msgspec.to_builtins(seen.look.curves)
    return HTMLResponse(
        page("record.html", root="../../", record=record, look=seen.look, curves=curves, said=record.said)
    )


async def _close(_: Request, desk: Desk, record: OpenRecord) -> Response:
    desk.remove(record)
    return JSONResponse({})


async def _receive(request: Request, desk: Desk, record: OpenRecord) -> Response:
    try:
        await record.receive(request.path_params["path"], request.stream())
    except (UnusableInput, ClientDisconnect):
        desk.remove(record)
        raise
    return JSONResponse({})


async def _diagnose(request: Request, desk: Desk, record: OpenRecord) -> Response:
    try:
        said = msgspec.json.decode(await request.body(), type=Settings)
    except msgspec.MsgspecError as error:
        raise UnusableInput(f"this is no description of a record: {error}") from None
    return JSONResponse({"number": desk.begin(record, said)})


def _job(request: Request, record: OpenRecord) -> Job:
    job = record.diagnoses.get(request.path_params["number"])
    if job is None:
        raise UnusableInput("there is no such diagnosis of this record")
    return job


async def _diagnosis(request: Request, _: Desk, record: OpenRecord) -> Response:
    job = _job(request, record)
    if job.ended is not None and job.ended.headline:
        # The page brings its own policy, which allows nothing from anywhere.
        policy = {"Content-Security-Policy": "frame-ancestors 'none'"}
        return FileResponse(Path(job.order.out) / worker.SHOWN, headers=policy)
    return HTMLResponse(page("progress.html", root="../../../", record=record, job=job))


async def _state(request: Request, _: Desk, record: OpenRecord) -> Response:
    job = _job(request, record)
    return JSONResponse({"stages": job.stages, "seconds": job.seconds, "ended": job.ended is not None})


async def _stop(request: Request, _: Desk, record: OpenRecord) -> Response:
    _job(request, record).stop()
    return JSONResponse({})


async def _download(request: Request, _: Desk, record: OpenRecord) -> Response:
    job = _job(request, record)
    if request.path_params["what"] not in DOWNLOADS or job.ended is None or not job.ended.headline:
        raise UnusableInput("there is nothing of that name to take away")
    file, name = DOWNLOADS[request.path_params["what"]]
    return FileResponse(Path(job.order.out) / file, filename=name.format(Path(record.source).stem))
