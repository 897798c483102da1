"""Certificates that nothing visits an obligation, and their check by a route of its own (semantics 8.5, decision 18)."""

from scbm.certifying.certificate import (
    Argument,
    Awaits,
    Certificate,
    Claim,
    Fact,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
)

__all__ = [
    "Argument",
    "Awaits",
    "Certificate",
    "Claim",
    "Fact",
    "RunsArgument",
    "Situation",
    "StructureArgument",
    "ValuesArgument",
]
