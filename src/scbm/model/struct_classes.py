"""Classes of structs: with abstract methods, and with fields that equality leaves out, such as the place in a text."""

from __future__ import annotations

from abc import ABCMeta
from typing import ClassVar

from msgspec import Struct, StructMeta


class AbstractStruct(StructMeta, ABCMeta):
    """The metaclass of structs with abstract methods."""


class PartlyCompared(Struct, frozen=True, eq=False):
    """A record that is equal to another one of its class if all fields but those of `uncompared` are equal."""

    uncompared: ClassVar[tuple[str, ...]] = ()
    """The names of the fields that equality and hash leave out."""

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._compared() == other._compared()

    def __ne__(self, other: object) -> bool:
        return not self == other  # the base class compares all fields

    def __hash__(self) -> int:
        return hash(self._compared())

    def _compared(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in self.__struct_fields__ if name not in self.uncompared)
