"""Options made from registries when a command line is read, so that a new entry needs no option of its own."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from enum import StrEnum
from functools import wraps
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Annotated, Any, Protocol, get_args, get_origin

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from typer.models import OptionInfo


class RegistryOptions(Protocol):
    """The part of an annotation that says: this parameter of a verb is made from a registry."""

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the parameters that typer sees in place of `parameter`."""
        ...

    def value(self, parameter: Parameter, values: dict[str, Any]) -> Any:  # noqa: ANN401 - as the verb declares it
        """Return what the verb gets, and remove it from the values that typer gives."""
        ...


@dataclass(frozen=True, slots=True)
class NameOf:
    """One option whose choices are the names of a registry.

    Attributes:
        names: returns the names.
        option: the option as typer declares it.
    """

    names: Callable[[], Iterable[str]]
    option: OptionInfo

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the option with an enumeration of the names as its type."""
        make: Any = StrEnum  # mypy knows enumerations by their literals alone
        choice = make("choice", {f"choice_{number}": name for number, name in enumerate(self.names())})
        return (parameter.replace(annotation=Annotated[choice | None, self.option]),)

    def value(self, parameter: Parameter, values: dict[str, Any]) -> str | None:
        """Return the chosen name as plain text."""
        chosen = values.pop(parameter.name)
        return None if chosen is None else str(chosen)


@dataclass(frozen=True, slots=True)
class KnownName:
    """One option with a name of a registry as its value, which the help lists; the verb refuses other names.

    Attributes:
        names: returns the names.
        option: the option as typer declares it.
    """

    names: Callable[[], Iterable[str]]
    option: OptionInfo

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the option with the names in place of a word for its value."""
        shown = copy(self.option)
        shown.metavar = f"[{'|'.join(self.names())}]"
        return (parameter.replace(annotation=Annotated[str | None, shown]),)

    def value(self, parameter: Parameter, values: dict[str, Any]) -> str | None:
        """Return the name."""
        name: str | None = values.pop(parameter.name)
        return name


@dataclass(frozen=True, slots=True)
class OptionPerEntry:
    """One option for each entry of a registry; the verb gets a mapping from names to values.

    Attributes:
        make: returns the type and the option of each entry.
    """

    make: Callable[[], Mapping[str, tuple[Any, OptionInfo]]]

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return one keyword parameter for each entry."""
        return tuple(
            Parameter(_identifier(name), parameter.kind, default=None, annotation=Annotated[kind, option])
            for name, (kind, option) in self.make().items()
        )

    def value(self, parameter: Parameter, values: dict[str, Any]) -> dict[str, Any]:  # noqa: ARG002 - as `NameOf`
        """Return the values by the names of the entries."""
        return {name: values.pop(_identifier(name)) for name in self.make()}


def _identifier(name: str) -> str:
    return name.replace("-", "_")


def with_registry_options(command: Callable[..., int]) -> Callable[..., int]:
    """Return the command with its marked parameters replaced by the options that the registries have now."""
    parameters = signature(command, eval_str=True).parameters
    marked = {name: mark for name, each in parameters.items() if (mark := _mark(each.annotation)) is not None}

    @wraps(command)
    def call(**values: Any) -> int:  # noqa: ANN401 - whatever the options of the verb are
        gathered = {name: mark.value(parameters[name], values) for name, mark in marked.items()}
        return command(**values, **gathered)

    shown = [
        option
        for name, parameter in parameters.items()
        for option in (marked[name].options(parameter) if name in marked else (parameter,))
    ]
    call.__signature__ = signature(command).replace(parameters=shown)  # type: ignore[attr-defined] # read by `inspect`
    return call


def _mark(annotation: object) -> NameOf | KnownName | OptionPerEntry | None:
    if get_origin(annotation) is not Annotated:
        return None
    return next((part for part in get_args(annotation) if isinstance(part, NameOf | KnownName | OptionPerEntry)), None)
