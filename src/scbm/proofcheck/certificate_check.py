"""Checks whether a certificate proves its claims."""

from __future__ import annotations

from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING

from scbm.proofcheck.certificate import CertificateFlaw
from scbm.proofcheck.certificate_arguments import ARGUMENTS
from scbm.proofcheck.claimed_obligations import claimable_obligations

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel
    from scbm.proofcheck.certificate import Certificate

MAX_FLAWS = 20
"""Maximum number of flaws that are reported."""


def check_certificate(certificate: Certificate, model: BehaviorModel) -> tuple[CertificateFlaw, ...]:
    """Return the first flaws of a certificate; none if it proves its claims for this model.

    Args:
        certificate: a certificate of any origin; the check trusts nothing in it.
        model: the model. The caller compares it with `certificate.digest`.
    """
    return tuple(islice(_flaws(certificate, model), MAX_FLAWS))


def _flaws(certificate: Certificate, model: BehaviorModel) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the claims themselves, or else of the argument."""
    if certificate.model != model.name:
        yield CertificateFlaw(
            "the certificate", f"it is one of the model {certificate.model}, and this is {model.name}"
        )
        return
    known = {str(obligation): obligation for obligation in claimable_obligations(model)}
    names = [claim.obligation for claim in certificate.claims]
    flaws = [
        CertificateFlaw(f"claim {name}", "the model has no such obligation") for name in names if name not in known
    ]
    flaws += [
        CertificateFlaw(f"claim {name}", "it is made twice") for name, times in Counter(names).items() if times > 1
    ]
    if not names:
        flaws.append(CertificateFlaw("the claims", "there are none"))
    argument = certificate.argument
    yield from flaws or ARGUMENTS[argument.kind].check([known[name] for name in names], argument, model)
