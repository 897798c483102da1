"""Options made from registries when a command line is read, so that a new entry needs none, and groups of options."""

from __future__ import annotations

from copy import copy
from enum import StrEnum
from functools import wraps
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Annotated, Any, Protocol, get_args, get_origin

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from typer.models import OptionInfo


class RegistryOptions(Protocol):
    """The part of an annotation that says: this parameter of a verb stands for options of a registry, or of a group."""

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the parameters that typer sees in place of `parameter`."""
        ...

    def value(self, parameter: Parameter, values: dict[str, Any]) -> Any:  # noqa: ANN401 - as the verb declares it
        """Return what the verb gets, and remove it from the values that typer gives."""
        ...


class RegistryName(Struct, frozen=True):
    """One option whose value is a name of a registry.

    Attributes:
        names: returns the names.
        option: the option as typer declares it.
    """

    names: Callable[[], Iterable[str]]
    option: OptionInfo


class NameOf(RegistryName, frozen=True):
    """One option whose choices are the names of a registry."""

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the option with an enumeration of the names as its type."""
        make: Any = StrEnum  # mypy knows enumerations by their literals alone
        choice = make("choice", {f"choice_{number}": name for number, name in enumerate(self.names())})
        return (parameter.replace(annotation=Annotated[choice | None, self.option]),)

    def value(self, parameter: Parameter, values: dict[str, Any]) -> str | None:
        """Return the chosen name as plain text."""
        chosen = values.pop(parameter.name)
        return None if chosen is None else str(chosen)


class KnownName(RegistryName, frozen=True):
    """One option with a name of a registry as its value; its help has the names, and the verb refuses other names."""

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the option with the names in place of `{names}` in its help."""
        shown = copy(self.option)
        shown.metavar = "NAME"
        shown.help = (self.option.help or "").format(names=", ".join(self.names()))
        return (parameter.replace(annotation=Annotated[str | None, shown]),)

    def value(self, parameter: Parameter, values: dict[str, Any]) -> str | None:
        """Return the name."""
        name: str | None = values.pop(parameter.name)
        return name


class OptionPerEntry(Struct, frozen=True):
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


class OptionGroup(Struct, frozen=True):
    """Options that belong together; the verb gets one value made from all of them.

    Attributes:
        make: returns that value; its parameters are the options.
    """

    make: Callable[..., Any]

    def options(self, parameter: Parameter) -> tuple[Parameter, ...]:
        """Return the options of the group, at the place of the parameter."""
        parameters, marked = _parameters(self.make)
        return tuple(each.replace(kind=parameter.kind) for each in _shown(parameters, marked))

    def value(self, parameter: Parameter, values: dict[str, Any]) -> Any:  # noqa: ANN401, ARG002 - as `make` declares it
        """Return what `make` returns for the values of the options."""
        parameters, marked = _parameters(self.make)
        gathered = _gathered(parameters, marked, values)
        return self.make(**gathered, **{name: values.pop(name) for name in parameters if name not in marked})


def _identifier(name: str) -> str:
    return name.replace("-", "_")


def with_registry_options(command: Callable[..., int]) -> Callable[..., int]:
    """Return the command with its marked parameters replaced by the options that they stand for now."""
    parameters, marked = _parameters(command)

    @wraps(command)
    def call(**values: Any) -> int:  # noqa: ANN401 - whatever the options of the verb are
        gathered = _gathered(parameters, marked, values)
        return command(**values, **gathered)

    shown = signature(command).replace(parameters=_shown(parameters, marked))
    call.__signature__ = shown  # type: ignore[attr-defined] # read by `inspect`
    return call


def _parameters(function: Callable[..., Any]) -> tuple[Mapping[str, Parameter], dict[str, RegistryOptions]]:
    """Return the parameters of a function, and the marks of those that have one."""
    parameters = signature(function, eval_str=True).parameters
    return parameters, {name: mark for name, each in parameters.items() if (mark := _mark(each.annotation)) is not None}


def _shown(parameters: Mapping[str, Parameter], marked: Mapping[str, RegistryOptions]) -> list[Parameter]:
    """Return the parameters that typer sees."""
    return [
        option
        for name, parameter in parameters.items()
        for option in (marked[name].options(parameter) if name in marked else (parameter,))
    ]


def _gathered(
    parameters: Mapping[str, Parameter], marked: Mapping[str, RegistryOptions], values: dict[str, Any]
) -> dict[str, Any]:
    """Return the values of the marked parameters, and remove their options from the values that typer gives."""
    return {name: mark.value(parameters[name], values) for name, mark in marked.items()}


def _mark(annotation: object) -> RegistryOptions | None:
    if get_origin(annotation) is not Annotated:
        return None
    marks = NameOf | KnownName | OptionPerEntry | OptionGroup
    return next((part for part in get_args(annotation) if isinstance(part, marks)), None)
