"""Names in error messages as the file has them: those of entries for instances, those of parts for their copies."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from msgspec import Struct, field

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*", re.ASCII)
_PARAMETER = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_QUOTED = re.compile(r"`([A-Za-z_]\w*)`", re.ASCII)
_NUMBER = re.compile(r"(?<![\w.])\d+")
_PREFIXES = ("", "start_", "complete_", "fail_")
"""What the name of an operation, and of its transitions, begins with."""

_INDEX = re.compile(r"(?P<base>[\w.]+)\[(?P<kinds>[^\]]+)\](?P<rest>.*)", re.ASCII)
_LIST = re.compile(r"(?P<head>[a-z ]+: )(?P<names>[\w.]+(?:, [\w.]+)*)(?P<rest>(?:, …)?)", re.ASCII)
"""A list of known names, as `suggestion` makes it."""


class CopiedNames(Struct, frozen=True):
    """The prefixes that the names of a part have in its copies.

    Attributes:
        prefixes: the prefix of each copy, such as `left.`.
        parameters: the parameters of the part.
    """

    prefixes: tuple[str, ...]
    parameters: tuple[str, ...] = ()

    def by_own_name(self, known: Iterable[str]) -> dict[str, str]:
        """Return the names of a model that the part declares, by their names in the part; of copies, those of one."""
        found: dict[str, str] = {}
        for name in known:
            prefix = next((prefix for prefix in self.prefixes if name.startswith(prefix)), None)
            if prefix is not None:
                found.setdefault(name.removeprefix(prefix), name)
        return found

    def in_text(self, text: str) -> str:
        """Return a text with names as the part has them; names of transitions may begin with what they do."""
        alternatives = "|".join(re.escape(prefix) for prefix in dict.fromkeys(self.prefixes))
        own = re.sub(rf"(?<![\w.])(start_|complete_|fail_)?(?:{alternatives})(?=[A-Za-z_])", r"\1", text)
        listed = _LIST.fullmatch(own)
        if listed is None:
            return own
        return f"{listed['head']}{', '.join(dict.fromkeys(listed['names'].split(', ')))}{listed['rest']}"


class EntryInstance(Struct, frozen=True):
    """One instance of an entry with parameters.

    Attributes:
        name: the name of the instance, such as `move.r1.b`.
        entry: the name of the entry, such as `move`.
        parameters: for each object of the instance the parameter that has it; without objects that several have, and
            empty for an entry whose parameters have no names.
        count: the number of instances of the entry.
    """

    name: str
    entry: str
    parameters: Mapping[str, str]
    count: int


class InstanceNames(Struct, frozen=True):
    """The names that an expansion made.

    Attributes:
        lifted: the name of an entry as it is written, by the name of each of its instances: `at[robot]` by `at.r1`.
        objects: the objects that names of instances contain.
        types: the types of objects; any other word in place of an object is a parameter.
        choices: the objects of each instance, by the names that `lifted` has.
        instances: the instances, by their sections and names.
    """

    lifted: Mapping[str, str] = field(default_factory=dict)
    objects: frozenset[str] = frozenset()
    types: frozenset[str] = frozenset()
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    instances: Mapping[tuple[str, str], EntryInstance] = field(default_factory=dict)

    def in_text(
        self, text: str, written: str, parameters: Mapping[str, str] | None = None, underlined: str = ""
    ) -> str:
        """Return a text in which entries stand for their instances.

        Args:
            text: a message or a remedy.
            written: the line that it is about; an instance that is named there keeps its name.
            parameters: of a remedy, a parameter for each type: what it says to write can be written in this entry.
            underlined: of a remedy, what the error underlines: a name is written as it stands there.
        """
        listed = _LIST.fullmatch(text)
        if listed is not None:
            names = dict.fromkeys(self._shown(name, written) for name in listed["names"].split(", "))
            return f"{listed['head']}{', '.join(names)}{listed['rest']}"
        if parameters is not None:
            return _NAME.sub(lambda match: self._usable(match[0], written, parameters, underlined), text)
        return _NAME.sub(lambda match: self._shown(match[0], written), text) if self.lifted else text

    def _usable(self, name: str, written: str, parameters: Mapping[str, str], underlined: str) -> str:
        """Return the name of an instance with parameters in place of its objects, if there is one for each type."""
        index, same = _INDEX.fullmatch(self._shown(name, written)), _INDEX.fullmatch(underlined)
        if index is not None and same is not None and (index["base"], index["rest"]) == (same["base"], same["rest"]):
            return underlined
        kinds = [part.split()[-1] for part in index["kinds"].split(",")] if index is not None else []
        if index is None or not all(kind in parameters for kind in kinds):
            return name
        return f"{'.'.join((index['base'], *(parameters[kind] for kind in kinds)))}{index['rest']}"

    def with_parameter(self, text: str, underlined: str) -> str:
        """Return a text with a parameter in place of its object, if the parameter alone is underlined."""
        if not _PARAMETER.fullmatch(underlined) or underlined in self.objects or underlined in self.types:
            return text
        return _QUOTED.sub(lambda match: f"`{underlined}`" if match[1] in self.objects else match[0], text)

    def _shown(self, name: str, written: str) -> str:
        lifted = self.lifted.get(name)
        return name if lifted is None or name in written else lifted

    def in_entry(self, text: str, instance: EntryInstance) -> str:
        """Return a text about an instance for its entry: `arm_req_trigger.r` for `arm.r1_req_trigger`."""
        return _NAME.sub(lambda match: self._within(match[0], instance), text)

    def _within(self, name: str, instance: EntryInstance) -> str:
        if name.endswith(instance.name) and name.removesuffix(instance.name) in _PREFIXES:
            return f"{name.removesuffix(instance.name)}{instance.entry}"
        written = self.lifted.get(name)
        if written is None or not instance.parameters:
            return name if written is None else written
        base, _, rest = written.partition("[")
        index = ".".join(instance.parameters.get(each, each) for each in self.choices[name])
        return f"{base}.{index}{rest.rpartition(']')[2]}"

    def without_objects(self, text: str) -> str:
        """Return a text that is the same for all instances of an entry: without the names of objects."""
        text = _NAME.sub(lambda match: ".".join(self._anonymous(part) for part in match[0].split(".")), text)
        return _NUMBER.sub("*", text) if any(each.isdecimal() for each in self.objects) else text

    def _anonymous(self, word: str) -> str:
        return "*" if word in self.objects else word
