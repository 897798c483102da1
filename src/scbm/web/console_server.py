"""The server of a console: the page, and requests of JSON with a token. It keeps no session."""

from __future__ import annotations

from contextlib import asynccontextmanager
from importlib.resources import files
from secrets import compare_digest
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec import DecodeError
from msgspec.json import decode, encode
from msgspec.structs import replace
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response
from starlette.routing import Route

from scbm.web.case_edits import EditError
from scbm.web.console_runs import ConsoleRequest

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping

    from starlette.requests import Request

    from scbm.web.case_saver import CaseSaver
    from scbm.web.model_worker import ModelWorker
    from scbm.web.obligation_search import ObligationSearches

MAX_BODY = 1024 * 1024
"""Maximum size of a request in bytes; the largest cases that people write have a tenth of it."""

_PAGES = "scbm.web"
_REPORT = "scbm.reports.html"
ASSETS = {
    "": (_PAGES, "console.html", "text/html"),
    "console.js": (_PAGES, "console.js", "text/javascript"),
    "console.css": (_PAGES, "console.css", "text/css"),
    "timeline.js": (_REPORT, "timeline.js", "text/javascript"),
    "timeline.css": (_REPORT, "timeline.css", "text/css"),
    "page.css": (_REPORT, "page.css", "text/css"),
}
"""The files of the page by their addresses: package, name and type. The timeline is that of the HTML report."""

_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
_WORKER = ("facts", "run", "edit", "moment", "trace", "picture")


class Console(NamedTuple):
    """What a server offers.

    Attributes:
        worker: answers about the model.
        saver: saves cases.
        searches: looks for cases that visit obligations.
        token: what each request has to send.
        beginning: the text that the page begins with, and what it shows of the store.
    """

    worker: ModelWorker
    saver: CaseSaver
    searches: ObligationSearches
    token: str
    beginning: Mapping[str, Any]


class _RefusedError(Exception):
    """A request is not answered."""

    def __init__(self, status: int, words: str) -> None:
        super().__init__(words)
        self.status = status


def console_app(console: Console, port: int) -> Starlette:
    """Return the application of a console that is reached at a port of this computer alone."""
    hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
    api = _api(console)

    async def respond(request: Request) -> Response:
        try:
            content, kind = await _respond(request, hosts, console.token, api)
            return Response(content, 200, _HEADERS, kind)
        except _RefusedError as error:
            return _refused(error.status, str(error))
        except Exception as error:  # noqa: BLE001 - whatever is wrong with scbm, the page says it
            return _refused(500, f"this is a fault of scbm, not of your input: {error!r}")

    @asynccontextmanager
    async def ending(_: Starlette) -> AsyncIterator[None]:
        yield
        console.searches.end()
        console.worker.close()

    return Starlette(routes=[Route("/{path:path}", respond, methods=["GET", "POST"])], lifespan=ending)


def _refused(status: int, words: str) -> Response:
    return Response(encode({"refused": words}), status, _HEADERS, "application/json")


def _api(console: Console) -> dict[str, Callable[[ConsoleRequest], bytes]]:
    """Return what answers each request by its name."""

    def asked(name: str) -> Callable[[ConsoleRequest], bytes]:
        return lambda request: console.worker.ask(name, request)

    return {name: asked(name) for name in _WORKER} | {
        "begin": lambda _: encode(console.beginning),
        "digest": lambda _: encode({"digest": console.worker.digest()}),
        "save": lambda request: encode(_saved(console, request)),
        "search": lambda request: encode(console.searches.begin(request.obligation, request.page)),
        "search_state": lambda request: encode(console.searches.state(request.page)),
        "search_end": lambda request: encode(console.searches.end(request.page)),
    }


def _saved(console: Console, request: ConsoleRequest) -> dict[str, Any]:
    """Save a case; the answer has the text of the file."""
    try:
        console.saver.refuse(request.name, request.known)
        made = decode(console.worker.ask("save", replace(request, target=console.saver.model_path)))
        if "recorded" not in made:
            return dict(made)
        return {**made, **console.saver.save(request.name, request.known, made["text"])}
    except EditError as error:
        return {"refused": str(error)}


async def _respond(
    request: Request, hosts: tuple[str, ...], token: str, api: Mapping[str, Callable[[ConsoleRequest], bytes]]
) -> tuple[bytes, str]:
    """Return the content of a response and its type. Raise `_RefusedError`."""
    host, origin = request.headers.get("host", ""), request.headers.get("origin")
    if host not in hosts or origin not in (None, f"http://{host}"):
        raise _RefusedError(403, "this console answers only its own page")
    path = request.path_params["path"]
    if request.method != "POST":
        if path not in ASSETS:
            raise _RefusedError(404, f"there is no page /{path}")
        package, name, kind = ASSETS[path]
        return files(package).joinpath(name).read_bytes(), kind
    if not compare_digest(request.headers.get("x-scbm-token", "").encode(), token.encode()):
        raise _RefusedError(403, "the address has another token than `scbm console` printed; open that address again")
    if path not in api:
        raise _RefusedError(404, f"there is no request /{path}")
    return await run_in_threadpool(api[path], await _read(request)), "application/json"


async def _read(request: Request) -> ConsoleRequest:
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > MAX_BODY:
            raise _RefusedError(413, "the request is larger than 1 MiB, and no case is as large; shorten the text")
    try:
        return decode(body, type=ConsoleRequest)
    except (DecodeError, UnicodeDecodeError) as error:
        raise _RefusedError(400, f"this is no request of the page: {error}") from None
