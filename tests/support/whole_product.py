"""Imports all of scbm, and Hypothesis, as a user does: without the rewriting of `assert` by pytest.

pytest rewrites all modules of a distribution that has a plugin, in each process again if no bytecode is written. That
takes a second and more for each process, and the assertions are in the tests.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

from _pytest.assertion.rewrite import AssertionRewritingHook

_PACKAGES = ("scbm.closing", "scbm.nodes", "scbm.reports", "scbm.store", "scbm.testing")
"""Packages that import the modules of their names late."""


@contextmanager
def _plain_imports() -> Iterator[None]:
    before = list(sys.meta_path)
    sys.meta_path[:] = [finder for finder in before if not isinstance(finder, AssertionRewritingHook)]
    try:
        yield
    finally:
        sys.meta_path[:] = before


def _import_all() -> None:
    """pytester forgets the modules that a test within the process imports; earlier imports stay the same for all."""
    import_module("hypothesis")
    import_module("scbm.cli.application")
    for entry in import_module("scbm.cli.verb_registry").VERBS.values():
        import_module(entry.module)
    for package in map(import_module, _PACKAGES):
        for name in package.__all__:
            getattr(package, name)


with _plain_imports():
    _import_all()
