"""The checker has states of its own: a fault in packed states must not hide from it (decision 18)."""

from __future__ import annotations

import ast
from pathlib import Path

import scbm.proofcheck

MODULES = sorted(Path(scbm.proofcheck.__file__).parent.rglob("*.py"))


def test_the_checker_imports_no_packed_states() -> None:
    nodes = [node for path in MODULES for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    names = {alias.name for node in nodes if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names}
    assert "BehaviorModel" in names
    assert "Packing" not in names  # `scbm.model` offers it, too, so import-linter does not see this
