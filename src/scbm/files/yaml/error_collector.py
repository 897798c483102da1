"""Collects all errors and warnings of one text, with names as the text has them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.instance_names import InstanceNames
from scbm.model import Diagnostic, InputError, Place, Severity, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.files.yaml.instance_names import CopiedNames
    from scbm.files.yaml.source_text import SourceText


MAX_ERRORS = 100
"""The maximum number of errors reported for one file; a file with more has one cause that explains most of them."""


_MAX_CHARACTERS = 400
"""The maximum length of a message: names and domains in it can have any length."""


_QUOTED = re.compile(r"`[^`]*`")
_CHOICE = re.compile(r"(\w+)(?:\s+in\s+|\s*:\s*)(\w+)(?=[^()]*\.)", re.ASCII)
"""A parameter of a quantifier, with its type."""


def _quantified(before: str) -> dict[str, str]:
    """Return a parameter for each type, of the quantifiers whose brackets are open at the end of a text."""
    choices = _CHOICE.finditer(before)
    return {each[2]: each[1] for each in choices if before.count("(", each.end()) > before.count(")", each.end())}


class _NotedError(Struct):
    """An error that several instances of one entry may have.

    Attributes:
        first: what is wrong with the first instance that has it.
        lifted: the same for all instances.
        instances: the number of instances of the entry.
        count: the number of instances that have the error so far.
    """

    first: Diagnostic
    lifted: Diagnostic
    instances: int
    count: int = 1

    @property
    def shown(self) -> Diagnostic:
        """The error; if only some instances have it, that of the first one."""
        return self.lifted if self.count >= self.instances else self.first


class ErrorCollector:
    """The diagnostics of one text so far, and of the files that it includes.

    Attributes:
        leaves_out: whether something was left out because of an error that is noted elsewhere.
    """

    def __init__(self, source_lines: Sequence[str]) -> None:
        self._source_lines = source_lines
        self._others: dict[str, SourceText] = {}
        self._users: dict[str, Place] = {}
        self._found: dict[tuple[Place, Slug, str], _NotedError] = {}
        self._first_uses: dict[tuple[Place, Slug, str], tuple[tuple[Place, Slug, str], Place | None]] = {}
        self._folded: dict[tuple[str, int], int] = {}
        self._parameters: dict[tuple[str, int], Mapping[str, str]] = {}
        self._names: InstanceNames | None = InstanceNames()
        self._make_names: Callable[[], InstanceNames] = InstanceNames
        self._copies: dict[str, CopiedNames] = {}
        self._warnings: dict[tuple[Place, Slug], Diagnostic] = {}
        self.leaves_out = False

    def fold_lines(
        self, first: Place, last: int, instances: int = 0, parameters: Mapping[str, str] | None = None
    ) -> None:
        """Take the lines from `first` to the number `last` for those of one lifted entry.

        Its instances have the same errors in other words: each is noted once.

        Args:
            first: where the entry begins.
            last: the number of its last line.
            instances: the number of its instances, if that is known.
            parameters: a parameter of the entry for each type, for remedies.
        """
        lines = [(first.file, line) for line in range(first.line, last + 1)]
        self._folded |= dict.fromkeys(lines, instances)
        self._parameters |= dict.fromkeys(lines, parameters or {})

    def name_instances(self, make_names: Callable[[], InstanceNames]) -> None:
        """Write names of entries for those of their instances in all further errors.

        Args:
            make_names: returns the names; it is called with the first error.
        """
        self._make_names = make_names
        self._names = None

    def name_copies(self, copies: Mapping[str, CopiedNames]) -> None:
        """Write names in errors about parts as the file of the part has them.

        Args:
            copies: the names of the copies of parts, by the file of the part.
        """
        self._copies = dict(copies)

    def suggestion(self, name: str, known: Iterable[str], what: str, place: Place) -> str | None:
        """Return a remedy for an unknown name: the most similar one, else the list of known names.

        A part knows its own names and its parameters. Other names would tie it to one model.

        Args:
            name: the unknown name.
            known: the names of the model that fit here.
            what: what the list begins with; empty for no list.
            place: where the unknown name stands.
        """
        copies = self._copies.get(place.file)
        own = {each: each for each in known} if copies is None else copies.by_own_name(known)
        parameters = () if copies is None else copies.parameters
        near = nearest(name if copies is None else copies.in_text(name), (*own, *parameters))
        if near is not None:
            return f"did you mean `{own.get(near, near)}`?"
        return suggestion("", own.values(), what) if what else None

    def parameters_of_part(self, place: Place) -> tuple[str, ...]:
        """Return the parameters of the part that a place is in; none for a place in a model."""
        copies = self._copies.get(place.file)
        return () if copies is None else copies.parameters

    def underlined(self, place: Place) -> str:
        """Return the text that errors at a place underline."""
        return (self._source_line(place) or "")[place.column - 1 :][: place.length]

    def add_source(self, source: SourceText, user: Place | None = None) -> None:
        """Take another file, whose lines are shown with the errors in it; its errors follow those of earlier files.

        Args:
            source: the file.
            user: where it is used first; errors in the file name this place.
        """
        self._others.setdefault(source.file, source)
        if user is not None:
            self._users.setdefault(source.file, user)

    @property
    def others(self) -> dict[str, SourceText]:
        """The other files, by the names that places have."""
        return dict(self._others)

    @property
    def instance_names(self) -> InstanceNames:
        """The names of instances, made at the first use."""
        if self._names is None:
            self._names = self._make_names()
        return self._names

    def add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Note one error. The same error at the same place is noted once: an alias is read as often as it is used.

        Of several uses, the error names the first; none if the text is wrong where it stands.

        Raises:
            InputError: the maximum number of errors is reached.
        """
        names = self.instance_names
        instances = self._folded.get((place.file, place.line))
        lifted = self._as_written(message, place, is_lifted=True)
        key = self._first_use((place, slug, names.without_objects(lifted)))
        noted = self._found.get(key)
        if noted is not None and _number_of_users(noted.first.place) <= _number_of_users(place):
            noted.count += 1
            return
        shown = None if remedy is None else self._remedy_as_written(remedy, place)
        copies = self._copies.get(place.file)
        number = (1 if instances is None else instances) * (len(copies.prefixes) if copies is not None else 1)
        first = self._diagnostic(slug, message, place, remedy)
        count = 1 if noted is None else noted.count + 1
        self._found[key] = _NotedError(first, self._diagnostic(slug, lifted, place, shown), number, count)
        if len(self._found) >= MAX_ERRORS:
            raise self.error()

    def _first_use(self, key: tuple[Place, Slug, str]) -> tuple[Place, Slug, str]:
        """Return the key of the same error of an earlier use of an anchored text; `key` itself if there is none.

        The errors of two uses may differ in the names that they quote, such as that of the variable.
        """
        place, slug, message = key
        first, user = self._first_uses.setdefault((place, slug, _QUOTED.sub("``", message)), (key, place.user))
        has_alias = any(each is not None and each.file == place.file for each in (user, place.user))
        return first if has_alias and user != place.user else key

    def warn(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Note one warning, which is shown if the text has no errors; that of several instances of an entry once."""
        is_lifted = (place.file, place.line) in self._folded
        self._names = self.instance_names if is_lifted else self._names  # they are made at the first use
        shown = self._as_written(message, place, is_lifted=is_lifted)
        warning = replace(self._diagnostic(slug, shown, place, remedy), severity=Severity.WARNING)
        self._warnings.setdefault((place, slug), warning)

    def _as_written(self, text: str, place: Place, *, is_lifted: bool) -> str:
        """Return a message or a remedy with names as the file has them; of entries, only with `is_lifted`."""
        if self._names is not None and is_lifted:
            line = self._source_line(place) or ""
            text = self._names.in_text(text, line)
            text = self._names.with_parameter(text, line[place.column - 1 :][: place.length])
        copies = self._copies.get(place.file)
        return text if copies is None else copies.in_text(text)

    def _remedy_as_written(self, remedy: str, place: Place) -> str:
        """Return a remedy with names that can be written where the error is."""
        line = self._source_line(place) or ""
        own, quantified = self._parameters.get((place.file, place.line)), _quantified(line[: place.column - 1])
        if self._names is not None and (own is not None or quantified):
            remedy = self._names.in_text(remedy, line, {**(own or {}), **quantified}, self.underlined(place))
        return self._as_written(remedy, place, is_lifted=False)

    def _source_line(self, place: Place) -> str | None:
        lines = self._others[place.file].lines if place.file in self._others else self._source_lines
        return lines[place.line - 1] if 0 < place.line <= len(lines) else None

    def _diagnostic(self, slug: Slug, message: str, place: Place, remedy: str | None) -> Diagnostic:
        shown = _shown(f"{message}{self._uses(place)}")
        return Diagnostic(slug, shown, place, _shown(remedy) if remedy else None, self._source_line(place))

    def _uses(self, place: Place) -> str:
        """Return where a text is used, for the end of a message; each file once, in brackets."""
        shown: list[str] = []
        files = [place.file]
        user = place.user or self._users.get(place.file)
        while user is not None:
            if user.file == files[-1] or user.file not in files:
                shown.append(f"used in {user.file}:{user.line}")
                files.append(user.file)
            user = user.user or self._users.get(user.file)
        return f" ({', which is '.join(shown)})" if shown else ""

    def add_found(self, diagnostics: Iterable[Diagnostic], user: Place) -> None:
        """Take errors that were found in another file before it was known here.

        Args:
            diagnostics: the errors.
            user: where the file is used.
        """
        for found in diagnostics:
            used = f"{found.message}{self._uses(found.place.used_at(user))}"
            shown = replace(found, message=used)
            self._found.setdefault((found.place, found.slug, found.message), _NotedError(shown, shown, 0))

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """The errors so far, in the order in which they were found."""
        return tuple(noted.shown for noted in self._found.values())

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """The warnings so far, in the order in which they were found."""
        return tuple(self._warnings.values())

    def copy(self) -> ErrorCollector:
        """Return a collector with the same diagnostics: a text that is parsed once can be read for several models."""
        copied = ErrorCollector(self._source_lines)
        copied._others.update(self._others)
        copied._users.update(self._users)
        copied._found.update((key, replace(noted)) for key, noted in self._found.items())
        copied._first_uses.update(self._first_uses)
        copied._folded.update(self._folded)
        copied._parameters.update(self._parameters)
        copied._names = self._names
        copied._make_names = self._make_names
        copied._copies = self._copies
        copied._warnings.update(self._warnings)
        copied.leaves_out = self.leaves_out
        return copied

    def __len__(self) -> int:
        return len(self._found)

    def raise_any(self) -> None:
        """Raise `InputError` with all diagnostics in the order of the text, if there are any."""
        if self._found:
            raise self.error()

    def error(self) -> InputError:
        """Return all diagnostics in the order of the text; those of each other file follow."""
        ranks = {file: rank for rank, file in enumerate(self._others, start=1)}
        ordered = sorted(self.diagnostics, key=lambda found: (ranks.get(found.place.file, 0), found.order))
        return InputError(ordered)


def _number_of_users(place: Place) -> int:
    number = 0
    while place.user is not None:
        place = place.user
        number += 1
    return number


def _shown(words: str) -> str:
    """Return a text of limited length."""
    if len(words) <= _MAX_CHARACTERS:
        return words
    return f"{words[: _MAX_CHARACTERS // 2]} … {words[-_MAX_CHARACTERS // 2 :]}"
