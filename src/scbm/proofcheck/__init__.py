"""Certificates that nothing visits an obligation, and their check by a route of its own (semantics 8.5, decision 18).

Knows models, obligations and the plain planner. What finds certificates, and the runner, are strangers to it.
"""

from scbm.proofcheck.certificate import (
    Argument,
    Awaits,
    Certificate,
    CertificateFlaw,
    Claim,
    Fact,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
)
from scbm.proofcheck.certificate_check import check_certificate
from scbm.proofcheck.certificate_reader import read_certificate, read_certificate_file
from scbm.proofcheck.certificate_writer import FORMAT_VERSION, certificate_text

__all__ = [
    "FORMAT_VERSION",
    "Argument",
    "Awaits",
    "Certificate",
    "CertificateFlaw",
    "Claim",
    "Fact",
    "RunsArgument",
    "Situation",
    "StructureArgument",
    "ValuesArgument",
    "certificate_text",
    "check_certificate",
    "read_certificate",
    "read_certificate_file",
]
