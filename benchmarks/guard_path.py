"""Count how often one guard comes back to a module that it had left, on its way from YAML to its predicate.

A model with one guard is read while all calls are traced. A call has the guard if one of its arguments is the text of
the guard, or a YAML node, a scalar, a syntax tree, a token or a formula of it; all calls that such a call makes belong
to the way of the guard, too. The modules of these calls, in their order, are the way. Each module that occurs in it
again, after another one, is a return. `--list` prints the way. `--source FOLDER` measures another version.
"""

from __future__ import annotations

import argparse
import sys
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import FrameType

SOURCE = Path(__file__).parents[1] / "src"
NUMBER = "54321"
MODEL = f"""behavior_model: cell
types: {{robot: [r1]}}
variables:
  'count[robot]': {{domain: 0..60000, initial: 0}}
operations:
  'go[r in robot]': {{pre: {{g: 'count[r] == {NUMBER}'}}, post: {{g: true}}}}
"""
"""A model with one guard, which alone has this number."""

_PARTS = ("text", "scalar", "lifted", "children", "tree", "_tree", "left", "right", "value")
"""The attributes of nodes, scalars, trees, formulas and predicates that lead to the text of the guard or its number."""


def has_guard(value: object, levels: int = 4) -> bool:
    """Return whether a value is the guard, or leads to it in a few steps; the whole model does not count."""
    if isinstance(value, str):
        return value == NUMBER or value.endswith(f"== {NUMBER}")
    if not levels:
        return False
    if isinstance(value, list | tuple):
        return any(has_guard(each, levels - 1) for each in value)
    if getattr(value, "constant", None) == int(NUMBER):
        return True
    return any(has_guard(getattr(value, name, None), levels - 1) for name in _PARTS)


def way_of_guard(read: Callable[[], object]) -> list[str]:
    """Return the modules of the calls on the way of the guard, each once where calls of one follow each other."""
    seen: list[str] = []
    open_calls = 0  # those on the way that have not returned

    def trace(frame: FrameType, event: str, _: object) -> None:
        nonlocal open_calls
        if event == "return" and open_calls:
            open_calls -= 1
        if event != "call":
            return
        module = str(frame.f_globals.get("__name__", ""))
        count = frame.f_code.co_argcount + frame.f_code.co_kwonlyargcount
        values = [frame.f_locals.get(name) for name in frame.f_code.co_varnames[:count]]
        sys.setprofile(None)  # the search for the guard is no part of its way
        open_calls += bool(open_calls or any(has_guard(value) for value in values))
        if open_calls and module.startswith("scbm.files."):
            seen.append(module)
        sys.setprofile(trace)

    sys.setprofile(trace)
    try:
        read()
    finally:
        sys.setprofile(None)
    return [module for module, _ in groupby(seen)]


def returns(way: Sequence[str]) -> Iterator[str]:
    """Yield the modules that a way comes back to."""
    known: dict[str, None] = {}
    for module in way:
        if module in known:
            yield module
        known[module] = None


def main() -> None:
    """Print the number of returns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", type=Path, default=SOURCE, help="the folder with the package")
    parser.add_argument("--list", action="store_true", help="print the modules in their order")
    options = parser.parse_args()
    sys.path.insert(0, str(options.source))
    from scbm.files import read_model  # noqa: PLC0415 - of the version that is asked for

    read_model(MODEL.replace(NUMBER, "1"))  # so that modules are imported, and the tables of the parser are read
    way = way_of_guard(lambda: read_model(MODEL))
    if options.list:
        print("\n".join(way))
    print(f"{sum(1 for _ in returns(way))} returns, {len(dict.fromkeys(way))} modules")


if __name__ == "__main__":
    main()
