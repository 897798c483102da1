"""`--scbm-store`: what a session ran, added to a coverage store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scbm.errors import InputError
from scbm.notation import read_file
from scbm.pytest_plugin.ledger import Group
from scbm.reports.since import in_all, since_last_run
from scbm.storing import Recipe, begin_run, drawn_recipe, sayable, write_store, written_recipe

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pytest

    from scbm.pytest_plugin.ledger import Entry, Part


def keep(config: pytest.Config, parts: Sequence[Part], file: str) -> tuple[list[str], bool]:
    """Adds all cases of the session to a store; gives what is to be said, and whether all went well."""
    if not parts:
        return [f"{file}: no case was run, so nothing was added."], True
    if len(parts) > 1:
        names = ", ".join(part.file for part in parts)
        return [f"FAIL {file}: a coverage store is of one model, and cases of {len(parts)} were run: {names}."], False
    (part,) = parts
    try:
        return _kept(config, part, file), True
    except InputError as error:
        return [f"FAIL {line}" for diagnostic in error.diagnostics for line in str(diagnostic).splitlines()], False


def _kept(config: pytest.Config, part: Part, file: str) -> list[str]:
    run = begin_run(["pytest", *config.invocation_params.args], part.file, read_file(part.path))
    coverage = part.campaign.coverage
    with write_store(config.invocation_params.dir / file, part.campaign.model, run) as writer:
        for position, entry in enumerate(part.entries, start=1):
            writer.add(position, _recipe(part, entry), entry.result)
        since = since_last_run(coverage.obligations, writer.before, coverage.visited)
        return [since.plain, in_all(*writer.totals(), file).plain]


def _recipe(part: Part, entry: Entry) -> Recipe:
    case = entry.result.case
    if entry.group is Group.RANDOM:
        return drawn_recipe(case, "")
    return written_recipe(case, part.campaign.model, sayable(str(Path(entry.test.partition("::")[0]))))
