"""Certificates as text: JSON, one claim, variable or situation on a line, the same bytes for the same certificate."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from scbm.proofcheck.certificate import Awaits, RunsArgument, StructureArgument, ValuesArgument

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.proofcheck.certificate import Argument, Certificate, Situation

FORMAT_VERSION = 1


def certificate_text(certificate: Certificate) -> str:
    """The text that `read_certificate` reads."""
    claims = [_json({"obligation": claim.obligation, "reason": claim.reason}) for claim in certificate.claims]
    parts = [
        f'"scbm_certificate": {FORMAT_VERSION}',
        f'"model": {_json(certificate.model)}',
        f'"digest": {_json(certificate.digest)}',
        f'"claims": {_list(claims)}',
        f'"argument": {_json(certificate.argument.kind)}',
        *_argument(certificate.argument),
    ]
    return "{" + ",\n".join(parts) + "}\n"


def _argument(argument: Argument) -> list[str]:
    match argument:
        case StructureArgument(facts):
            return [f'"facts": {_json([fact.name.lower() for fact in facts])}']
        case ValuesArgument(values):
            lines = (f"{_json(name)}: {_json(allowed)}" for name, allowed in values)
            return ['"values": {\n' + ",\n".join(lines) + "\n}"]
        case RunsArgument(variables, runs):
            goals = (
                f'{{"goal": {_json(goal)}, "situations": {_list(map(_situation, situations))}}}'
                for goal, situations in runs
            )
            return [f'"variables": {_json(variables)}', f'"runs": {_list(goals)}']


def _situation(situation: Situation) -> str:
    """Its values, queue, and requests in flight; and what it awaits, if it awaits anything."""
    parts: list[object] = [situation.values, situation.queue, situation.in_flight]
    if situation.awaits is not Awaits.NOTHING:
        parts.append(situation.awaits.value)
    return json.dumps(parts, ensure_ascii=False, separators=(",", ":"))


def _list(lines: Iterable[str]) -> str:
    return "[\n" + ",\n".join(lines) + "\n]"


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False)
