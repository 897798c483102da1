"""Cases that cannot be run as some resources are real: refused before anything moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.realtime import beyond_reach

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cli.campaigns import Suite


def refuse_beyond_reach(suite: Suite, real: Sequence[str], option: str) -> None:
    """Raises `InputError` with all cases that say what nobody can bring about.

    Args:
        suite: the cases.
        real: the resources that are reached at real drivers.
        option: where random ones are told of.
    """
    if not real:
        return
    wrong = []
    for written in suite.written:
        if (why := beyond_reach(written.case, suite.model, real)) is not None:
            remedy = "leave this case out, or simulate more resources"
            wrong.append(Diagnostic(Slug.BEYOND_REACH, f"the case {why}", Place(str(written.path)), remedy))
    told = ((case.name, beyond_reach(case, suite.model, real)) for case in suite.drawn())
    drawn = [(name, why) for name, why in told if why is not None]
    if drawn:
        name, why = drawn[0]
        message = f"{len(drawn)} of {suite.random} random cases cannot be run: `{name}` {why}"
        remedy = "leave `--network` out, or simulate more resources"
        wrong.append(Diagnostic(Slug.BEYOND_REACH, message, Place(option), remedy))
    if wrong:
        raise InputError(wrong)
