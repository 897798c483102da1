"""Packages that import their names late list them from the beginning: for completion, `help()` and the site."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SOURCES = Path(__file__).parents[3] / "src"
PACKAGES = [
    ".".join(path.parent.relative_to(SOURCES).parts)
    for path in sorted(SOURCES.glob("scbm/**/__init__.py"))
    if re.search(r"^__getattr__ = lazy_exports\(", path.read_text(encoding="utf-8"), re.MULTILINE)
]
LISTED = """
import importlib, sys
for name in sys.argv[1:]:
    package = importlib.import_module(name)
    before = frozenset(sys.modules)
    listed = dir(package)
    assert frozenset(sys.modules) == before
    print(name, *sorted({*package.__all__} - {*listed}), *["unsorted"] * (listed != sorted(listed)))
"""


def test_a_package_lists_its_names_and_imports_nothing_for_that() -> None:
    assert len(PACKAGES) > 10
    command = [sys.executable, "-c", LISTED, *PACKAGES]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == PACKAGES
