"""Writes certificates as JSON: one claim, variable or situation on a line, the same bytes for the same certificate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.proofcheck.certificate_arguments import ARGUMENTS, json_list, json_text

if TYPE_CHECKING:
    from scbm.proofcheck.certificate import Certificate

FORMAT_VERSION = 1


def certificate_text(certificate: Certificate, model_file: str | None = None) -> str:
    """Return the text that `read_certificate_file` reads; `model_file` is the path of the model relative to it."""
    claims = [json_text({"obligation": claim.obligation, "reason": claim.reason}) for claim in certificate.claims]
    parts = [
        f'"scbm_certificate": {FORMAT_VERSION}',
        f'"model": {json_text(certificate.model)}',
        *([] if model_file is None else [f'"model_file": {json_text(model_file)}']),
        f'"digest": {json_text(certificate.digest)}',
        f'"claims": {json_list(claims)}',
        f'"argument": {json_text(certificate.argument.kind)}',
        *ARGUMENTS[certificate.argument.kind].write(certificate.argument),
    ]
    return "{" + ",\n".join(parts) + "}\n"
