"""Certificates, waivers, excuses and hazards as stores keep them: what is known of runs beside their visits."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import asdict

from scbm import __version__
from scbm.cases.coverage import Decision, StatusProof
from scbm.model import Waiver
from scbm.model.json_reader import convert_json, read_json
from scbm.running.simulation.device_hazards import Hazard
from scbm.store.packed_logs import packed_log, unpacked_log
from scbm.testing import Excuse
from scbm.testing.decided_requirements import OtherPlans

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.model import GoalOrder
    from scbm.testing.decided_requirements import KnownDecision

_KEY_BYTES = 16

_ENGINE = re.compile(r'^"argument": "(\w+)"', re.MULTILINE)
"""The line of a certificate that names the kind of its argument."""

_MAX_JSON_CHARACTERS = 64 * 1024 * 1024
"""The maximum length of a JSON text in a column; a store that holds a longer one is damaged."""


class StoredCertificate(Struct, frozen=True):
    """A certificate that was sound when it was added.

    Attributes:
        name: its file, as the command line named it.
        packed: its text, compressed.
        checked_by: the version of scbm that checked it.
        proofs: what it proves, by the names of the obligations.
        is_earlier: whether it is of an earlier version of the model.
    """

    name: str
    packed: bytes
    checked_by: str
    proofs: Mapping[str, StatusProof]
    is_earlier: bool = False

    @staticmethod
    def of(name: str, text: str, proofs: Mapping[str, StatusProof]) -> StoredCertificate:
        """Return a certificate that this version of scbm has checked. Raises `ValueError` if its text is too large."""
        return StoredCertificate(name, packed_log(text), __version__, proofs)

    @property
    def text(self) -> str:
        """The text of the certificate. Raises `ValueError` if it is damaged."""
        return unpacked_log(self.packed)

    @property
    def key(self) -> bytes:
        """The identity of the certificate: 16 bytes of the SHA-256 of its text."""
        return sha256(self.text.encode()).digest()[:_KEY_BYTES]

    @property
    def claims_text(self) -> str:
        """The proofs as JSON."""
        claims = [[name, proof.decision.value, proof.reason] for name, proof in self.proofs.items()]
        return json.dumps(claims, ensure_ascii=False)


class StoredDecision(Struct, frozen=True):
    """The answer of a closing about a requirement.

    Attributes:
        decision: the answer.
        planner: the name of the planner of the runs; that of drawn plans for any plans.
        goals: how many goals a run has.
        closed: when the model was closed.
    """

    decision: KnownDecision
    planner: str
    goals: GoalOrder
    closed: str


def other_plans_text(others: OtherPlans | None) -> str | None:
    """Return what is known of other plans as JSON; `None` for nothing."""
    if others is None:
        return None
    return json.dumps({"case": others.case, "file": others.file, "reason": others.reason}, ensure_ascii=False)


def read_other_plans_text(text: str | None) -> OtherPlans | None:
    """Return what is known of other plans. Raises `ValueError` if it is damaged."""
    return None if text is None else convert_json(read_json(text, _MAX_JSON_CHARACTERS), OtherPlans)


def read_certificate_row(row: tuple[str, bytes, str, str], *, is_earlier: bool) -> StoredCertificate:
    """Return the certificate of a row: name, packed text, version of the checker, claims. Raises `ValueError`."""
    name, packed, checked_by, claims = row
    found = _ENGINE.search(unpacked_log(packed))  # refuses damage
    engine = None if found is None else found[1]
    listed = convert_json(read_json(claims, _MAX_JSON_CHARACTERS), list[tuple[str, Decision, str]])
    proofs = {obligation: StatusProof(status, reason, name, engine) for obligation, status, reason in listed}
    return StoredCertificate(name, packed, checked_by, proofs, is_earlier)


def excuses_text(excuses: Iterable[Excuse]) -> str | None:
    """Return the excuses of a verdict as JSON; `None` for none."""
    listed = [excuse.value for excuse in excuses]
    return json.dumps(listed) if listed else None


def read_excuses_text(text: str | None) -> tuple[Excuse, ...]:
    """Return the excuses of a verdict. Raises `ValueError` if they are damaged."""
    return () if text is None else tuple(convert_json(read_json(text, _MAX_JSON_CHARACTERS), list[Excuse]))


def hazards_text(hazards: Sequence[Hazard]) -> str | None:
    """Return the hazards of a run as JSON; `None` for none."""
    return json.dumps([asdict(each) for each in hazards]) if hazards else None


def read_hazards_text(text: str | None) -> tuple[Hazard, ...]:
    """Return the hazards of a run. Raises `ValueError` if they are damaged."""
    return () if text is None else tuple(convert_json(read_json(text, _MAX_JSON_CHARACTERS), list[Hazard]))


class _WrittenWaiver(Struct, frozen=True):
    """A waiver as the JSON of a run has it."""

    obligation: str
    reason: str
    author: str
    date: str
    expires: str | None
    lifted: str = ""


def waivers_text(waivers: Iterable[Waiver]) -> str | None:
    """Return waivers as JSON; `None` for none."""
    listed = [
        {
            "obligation": waiver.obligation,
            "reason": waiver.reason,
            "author": waiver.author,
            "date": waiver.date,
            "expires": waiver.expires,
        }
        | ({"lifted": waiver.lifted} if waiver.lifted else {})
        for waiver in waivers
    ]
    return json.dumps(listed, ensure_ascii=False) if listed else None


def read_waivers_text(text: str | None) -> tuple[Waiver, ...]:
    """Return the waivers of a JSON text that `waivers_text` has written. Raises `ValueError` for any other text."""
    if text is None:
        return ()
    written = convert_json(read_json(text, _MAX_JSON_CHARACTERS), list[_WrittenWaiver])
    return tuple(
        Waiver(each.obligation, each.reason, each.author, each.date, each.expires, lifted=each.lifted)
        for each in written
    )
