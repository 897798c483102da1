"""Names that are imported when they are used first: those of a package, and those in rows of registries."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy_exports(package: str, exports: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package (PEP 562), which imports a name from its module when it is used first.

    `dir()` of the package lists these names, too: for completion, `help()` and the documentation. The package imports
    them under `TYPE_CHECKING`, where type checkers read them.

    Args:
        package: the name of the package.
        exports: for each module below the package the names that the package exports from it, with blanks
            between them.
    """
    modules = {name: module for module, names in exports.items() for name in names.split()}

    def load(name: str) -> Any:  # noqa: ANN401 - whatever the package exports
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{modules[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    whole = sys.modules[package]
    vars(whole)["__dir__"] = lambda: sorted({*vars(whole), *modules})
    return load


def load_named(place: str) -> Any:  # noqa: ANN401 - whatever the row names
    """Return what a row of a registry names as text, `package.module:name`; its module is imported now."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
