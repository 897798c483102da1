"""Certificates that no run visits an obligation, and their independent check (semantics 8.5, decision 18).

The checker imports `scbm.model` and nothing else of `scbm`: neither the runner, nor the planners, nor the code that
finds proofs.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.proofcheck.certificate import (
        GOAL,
        MAX_CHANGES,
        PHASE,
        Argument,
        Awaits,
        Certificate,
        CertificateFlaw,
        ContinuationsArgument,
        Fact,
        GoalContinuations,
        GoalRuns,
        RequirementsArgument,
        RequirementSetsArgument,
        RunsArgument,
        SetPhase,
        SetsArgument,
        Situation,
        StructureArgument,
        ValuesArgument,
        predicted_name,
        request_name,
    )
    from scbm.proofcheck.certificate_arguments import check_certificate
    from scbm.proofcheck.certificate_json import (
        FORMAT_VERSION,
        certificate_text,
        read_certificate,
        read_certificate_file,
    )

__all__ = [
    "FORMAT_VERSION",
    "GOAL",
    "MAX_CHANGES",
    "PHASE",
    "Argument",
    "Awaits",
    "Certificate",
    "CertificateFlaw",
    "ContinuationsArgument",
    "Fact",
    "GoalContinuations",
    "GoalRuns",
    "RequirementSetsArgument",
    "RequirementsArgument",
    "RunsArgument",
    "SetPhase",
    "SetsArgument",
    "Situation",
    "StructureArgument",
    "ValuesArgument",
    "certificate_text",
    "check_certificate",
    "predicted_name",
    "read_certificate",
    "read_certificate_file",
    "request_name",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "certificate": (
            "GOAL MAX_CHANGES PHASE Argument Awaits Certificate CertificateFlaw ContinuationsArgument Fact "
            "GoalContinuations GoalRuns RequirementSetsArgument RequirementsArgument RunsArgument SetPhase "
            "SetsArgument Situation StructureArgument ValuesArgument predicted_name request_name"
        ),
        "certificate_arguments": "check_certificate",
        "certificate_json": "FORMAT_VERSION certificate_text read_certificate read_certificate_file",
    },
)
