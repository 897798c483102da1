"""Packages whose names are imported when they are used first, and modules with deprecated names of packages."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import ModuleType


def lazy_exports(package: str, exports: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package (PEP 562), which imports a name from its module when it is used first.

    The package imports the same names under `TYPE_CHECKING`, where tools read them.

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

    return load


def deprecated_exports(old: str, package: ModuleType) -> Callable[[str], object]:
    """Return the `__getattr__` of the module `old`, whose names `package` has now; each import of a name warns once.

    The names that Python itself reads, such as `__path__`, are not those of the package: with a `__path__` the module
    would count as a package, and Python would look up each name twice. `__all__` is, for `from old import *`.
    """

    def load(name: str) -> object:
        is_internal = name.startswith("__") and name.endswith("__")
        if is_internal and name != "__all__":
            raise AttributeError(f"module {old!r} has no attribute {name!r}")
        value: object = getattr(package, name)
        if not is_internal:
            message = f"{old} is now {package.__name__}: import {name} from there"
            warnings.warn(message, DeprecationWarning, stacklevel=2)
        return value

    return load
