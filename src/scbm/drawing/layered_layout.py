"""The layout of a graph from left to right, by dagre within QuickJS (extra `draw`): `lay_out` hides both.

The file `vendored/dagre.min.js` is `dist/dagre.min.js` of `@dagrejs/dagre` 3.1.3 (MIT) from npm, unchanged; it contains
`@dagrejs/graphlib` 4.0.6 (MIT). Its SHA-256 is
54a503e346f93ca0bb10abe7999587e037262935687aca45eb4e4b0f64bbb578. QuickJS has no files, no network and no clock: one
graph has one layout, byte for byte.
"""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import import_module
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.json import decode, encode

from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

_MAX_MEMORY = 500_000_000
"""Maximum number of bytes of a context; 2,000 edges in one graph take about 100 MB."""

_MAX_SECONDS = 60
"""Maximum time of one layout in seconds of CPU. It ends the command and changes no picture."""

_STACK = 256 * 1024 * 1024
"""The size of the stack in bytes, of which only the used part takes memory: dagre calls itself along each way."""


class Point(NamedTuple):
    """A place in a picture, in pixels from its upper left corner."""

    x: float
    y: float


class LayoutNode(NamedTuple):
    """The size of a node, in pixels."""

    width: float
    height: float


class LayoutEdge(NamedTuple):
    """An edge between two nodes, by their indices, with the size of its label in pixels."""

    source: int
    target: int
    width: float
    height: float


class LayoutRoute(NamedTuple):
    """The way of an edge through points, and the center of its label."""

    points: tuple[Point, ...]
    label: Point


class GraphLayout(NamedTuple):
    """The size of a drawn graph, the centers of its nodes, and the ways of its edges, both in the order given."""

    size: Point
    nodes: tuple[Point, ...]
    routes: tuple[LayoutRoute, ...]


def lay_out(nodes: Sequence[LayoutNode], edges: Sequence[LayoutEdge]) -> GraphLayout:
    """Return the layout of a graph. Raise `InputError` without the extra `draw`, and for a graph that is too large."""
    library = _library()
    try:
        found = _thread().submit(_laid_out, encode({"nodes": nodes, "edges": edges}).decode()).result()
    except library.JSException:
        limits = f"{_MAX_MEMORY // 1_000_000} MB, or {_MAX_SECONDS} s"
        message = f"the layout of an automaton with {len(nodes)} values needs more than {limits}"
        remedy = "name other variables or operations; `--mermaid` works without a layout"
        raise InputError([Diagnostic(Slug.PICTURE_TOO_LARGE, message, Place("scbm draw"), remedy)]) from None
    return decode(found, type=GraphLayout)


@cache
def _thread() -> ThreadPoolExecutor:
    """Return the one thread that has a context of QuickJS: it may be used by one alone, and needs a large stack."""
    before = threading.stack_size(_STACK)
    made = ThreadPoolExecutor(1, "layout")
    made.submit(int).result()  # starts the thread
    threading.stack_size(before)
    return made


def _laid_out(graph: str) -> str:
    found: str = _context().get("layOut")(graph)
    return found


@cache
def _context() -> Any:  # noqa: ANN401 - a library that is optional, without types
    """Return the context, with dagre loaded."""
    context = _library().Context()
    context.set_memory_limit(_MAX_MEMORY)
    context.set_time_limit(_MAX_SECONDS)
    context.set_max_stack_size(_STACK - 1024 * 1024)
    for script in ("vendored/dagre.min.js", "layout.js"):
        context.eval(files(__package__).joinpath(script).read_text("utf-8"))
    return context


def _library() -> Any:  # noqa: ANN401 - as above
    try:
        return import_module("quickjs")
    except ModuleNotFoundError:
        message = "pictures need quickjs-ng, which is not installed"
        remedy = "run `pip install 'scbm[draw]'`; `--mermaid` works without it"
        raise InputError([Diagnostic(Slug.DRAWING_MISSING, message, Place("scbm draw"), remedy)]) from None
