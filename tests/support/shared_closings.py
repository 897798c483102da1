"""Closings and checks of certificates that tests of one process share: each is done once for equal inputs.

Closing is a function of its inputs, and its results are immutable. Tests of this property itself use `Closer`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scbm.cases.coverage import Obligation
from scbm.closing import CloseLimits, Closer, Closing
from scbm.model import BehaviorModel
from scbm.proofcheck import Certificate, CertificateFlaw, check_certificate
from scbm.testing import Campaign, CaseResult
from scbm.testing.batches.campaign_runs import Executor


@dataclass(frozen=True)
class _ClosingInputs:
    """Everything that the result of closing depends on."""

    model: BehaviorModel
    limits: CloseLimits
    suite: tuple[CaseResult, ...]
    wanted: tuple[Obligation, ...] | None
    one_case_each: bool


_CLOSINGS: list[tuple[_ClosingInputs, Closing]] = []

_FLAWS: list[tuple[Certificate, BehaviorModel, tuple[CertificateFlaw, ...]]] = []


class SharedCloser(Closer):
    """A closer that returns the closing of equal inputs, if this process has one."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits = CloseLimits(),  # noqa: B008 - an immutable value
        progress: Callable[[str], None] | None = None,
        executor: Executor | None = None,
    ) -> None:
        super().__init__(model, limits, progress, executor)
        self._inputs_limits = limits

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
        asked = None if wanted is None else tuple(wanted)
        inputs = _ClosingInputs(self.model, self._inputs_limits, results, asked, one_case_each)
        for known, closing in _CLOSINGS:
            if known == inputs:
                return closing
        closing = super().close(suite, wanted, one_case_each=one_case_each)
        if not closing.is_interrupted:
            _CLOSINGS.append((inputs, closing))
        return closing


def shared_closing(model: BehaviorModel, limits: CloseLimits = CloseLimits()) -> Closing:  # noqa: B008 - immutable
    """Return the closing of a model without a suite."""
    return SharedCloser(model, limits).close()


def shared_flaws(certificate: Certificate, model: BehaviorModel) -> tuple[CertificateFlaw, ...]:
    """Return the flaws of a certificate."""
    for known, of_model, flaws in _FLAWS:
        if (known, of_model) == (certificate, model):
            return flaws
    flaws = check_certificate(certificate, model)
    _FLAWS.append((certificate, model, flaws))
    return flaws
