"""Reads and writes payloads as bytes through cyclonedds, by calls that its Python API lacks.

`c_call` reads annotations while the program runs, so this module has no `from __future__ import annotations`.
"""

import ctypes
from collections.abc import Callable
from typing import TypeAlias

from cyclonedds._clayer import ddspy_take  # type: ignore[import-not-found]  # written in C
from cyclonedds.core import DDSException, Entity, InstanceState, Listener, SampleState, ViewState
from cyclonedds.idl import IdlStruct
from cyclonedds.internal import SampleInfo, c_call, dds_c_t
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
_AT_ONCE = 256


class _Payload(ctypes.Structure):
    """A sample of a cyclonedds topic: bytes with an encapsulation header."""

    _fields_ = (("data", ctypes.c_char_p), ("size", ctypes.c_size_t))


_PayloadPointer: TypeAlias = ctypes.POINTER(_Payload)  # type: ignore[valid-type]  # ctypes makes the type in a call


class RawWriter(DataWriter[IdlStruct]):
    """A writer of payloads.

    `DataWriter.write` keeps the GIL while it waits: for locks of Cyclone DDS, whose threads may wait for the GIL in a
    listener, and for acknowledgements, which those threads receive. This one lets it go.
    """

    def write_payload(self, payload: bytes) -> None:
        """Send a payload; raise `DDSException`, for a time-out too: subscriptions that do not acknowledge."""
        code = self._write_raw(self._ref, ctypes.byref(_Payload(payload, len(payload))))
        if code < 0:
            raise DDSException(code)

    @c_call("dds_write")  # type: ignore[no-untyped-call, untyped-decorator]  # cyclonedds gives it no types
    def _write_raw(
        self,
        writer: dds_c_t.entity,  # type: ignore[valid-type]  # types of ctypes, which `c_call` reads
        sample: _PayloadPointer,
    ) -> dds_c_t.returnv: ...  # type: ignore[valid-type]  # the same


class RawReader(DataReader[IdlStruct]):
    """A reader of payloads."""

    def take_payloads(self) -> list[tuple[bytes, SampleInfo]]:
        """Return all received samples in order. Raises `DDSException`."""
        taken: list[tuple[bytes, SampleInfo]] = []
        while True:
            part = ddspy_take(self._ref, _ANY, _AT_ONCE)
            if isinstance(part, int):
                raise DDSException(part)
            taken += part
            if len(part) < _AT_ONCE:
                return taken


def delete(entity: Entity) -> None:
    """Delete an entity at once, even while others refer to it. Deleting it again does nothing."""
    entity.__del__()  # cyclonedds has no other way


def listener(**called: Callable[..., None]) -> Listener:
    """Return a listener, made of functions such as `on_data_available`; they are called on threads of Cyclone DDS."""
    return Listener(**called)  # type: ignore[no-untyped-call]  # cyclonedds gives it no types


def refused_policy(endpoint: DataWriter[IdlStruct] | DataReader[IdlStruct]) -> int:
    """Return the number of the QoS policy of the latest mismatch, or 0."""
    if isinstance(endpoint, DataWriter):
        status = endpoint.get_offered_incompatible_qos_status()  # type: ignore[no-untyped-call]  # as in `listener`
    else:
        status = endpoint.get_requested_incompatible_qos_status()  # type: ignore[no-untyped-call]  # as in `listener`
    return int(status.last_policy_id) if status.total_count else 0
