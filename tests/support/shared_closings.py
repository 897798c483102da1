"""Closings and checks of certificates that tests of one process share: each is done once for equal inputs.

Closing is a function of its inputs, and its results are immutable. Tests of this property itself use `Closer`.
"""

from __future__ import annotations

from collections.abc import Sequence

from scbm.cases.coverage import Obligation
from scbm.closing import CloseLimits, Closer, Closing
from scbm.model import BehaviorModel
from scbm.proofcheck import Certificate, CertificateFlaw, check_certificate
from scbm.testing import Campaign

_CLOSINGS: dict[str, Closing] = {}
"""By the representation of all inputs, which tells 1 from true, unlike a comparison."""

_FLAWS: list[tuple[Certificate, str, tuple[CertificateFlaw, ...]]] = []
"""Certificates, each with the representation of its model, and its flaws."""


class SharedCloser(Closer):
    """A closer that returns the closing of equal inputs, if this process has one."""

    def close(
        self,
        suite: Campaign | None = None,
        wanted: Sequence[Obligation] | None = None,
        *,
        one_case_each: bool = False,
    ) -> Closing:
        if suite is not None and len(suite.results) < suite.count:
            return super().close(suite, wanted, one_case_each=one_case_each)  # not all cases are listed
        results = () if suite is None else suite.results
        inputs = repr((self.model, self._limits, results, wanted, one_case_each))
        if inputs in _CLOSINGS:
            return _CLOSINGS[inputs]
        closing = super().close(suite, wanted, one_case_each=one_case_each)
        if not closing.is_interrupted:
            _CLOSINGS[inputs] = closing
        return closing


def shared_closing(model: BehaviorModel, limits: CloseLimits = CloseLimits()) -> Closing:  # noqa: B008 - immutable
    """Return the closing of a model without a suite."""
    return SharedCloser(model, limits).close()


def shared_flaws(certificate: Certificate, model: BehaviorModel) -> tuple[CertificateFlaw, ...]:
    """Return the flaws of a certificate."""
    text = repr(model)
    for known, of_model, flaws in _FLAWS:
        if (known, of_model) == (certificate, text):
            return flaws
    flaws = check_certificate(certificate, model)
    _FLAWS.append((certificate, text, flaws))
    return flaws
