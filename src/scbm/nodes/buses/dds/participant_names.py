"""Names of other participants for people: the process and the machine that Cyclone DDS announces."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant
from cyclonedds.core import Policy

from scbm.nodes.buses.dds.raw_samples import delete

if TYPE_CHECKING:
    from collections.abc import Iterable
    from uuid import UUID

    from cyclonedds.core import Qos
    from cyclonedds.domain import DomainParticipant

_MOST = 1000
"""Maximum number of participants that are looked through."""


def participant_names(participant: DomainParticipant, keys: Iterable[UUID]) -> tuple[str, ...]:
    """Return a name for each of some participants, sorted; a participant without properties is named by its key."""
    reader = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
    known = {sample.key: _name(sample.qos) for sample in reader.take(_MOST)}
    delete(reader)
    return tuple(sorted(known.get(key) or f"participant {key}" for key in keys))


def _name(qos: Qos) -> str | None:
    properties = {policy.key: policy.value for policy in qos if isinstance(policy, Policy.Property)}
    process, number, machine = (properties.get(f"__{key}") for key in ("ProcessName", "Pid", "Hostname"))
    if number is None:
        return None
    return f"{process or 'a program'} (process {number}{f' on {machine}' if machine else ''})"
