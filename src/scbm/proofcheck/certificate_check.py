"""Whether a certificate proves what it claims."""

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
"""So many flaws are told."""


def check_certificate(certificate: Certificate, model: BehaviorModel) -> tuple[CertificateFlaw, ...]:
    """The first flaws of a certificate; none if it proves its claims for this model.

    Args:
        certificate: of any origin; nothing in it is believed.
        model: whether it is the model that `certificate.digest` tells is for the caller to compare.
    """
    return tuple(islice(_flaws(certificate, model), MAX_FLAWS))


def _flaws(certificate: Certificate, model: BehaviorModel) -> Iterator[CertificateFlaw]:
    """What is wrong with the claims themselves, or else with the argument."""
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
