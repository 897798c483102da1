"""`scbm check`: errors and warnings of model files."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.verb_options import Bindings, Json
from scbm.cli.output.terminal import activity_display, count_of, errors, results, write_json
from scbm.closing.advice import THOROUGH, Checked, CheckLimits, Doubt, check_model
from scbm.closing.current_date import today
from scbm.files import Places, load_bindings, load_located
from scbm.model import BehaviorModel, Binding, Diagnostic, InputError, Severity
from scbm.model.visible_text import counted

FORMAT_VERSION = 1


def command(
    models: Annotated[
        list[Path], typer.Argument(metavar="MODEL...", help="Model files.", show_default=False), Reads("a model")
    ],
    *,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 1 if there are warnings.")] = False,
    thorough: Annotated[
        bool, typer.Option("--thorough", help="Continue the exploration for warnings beyond its limit.")
    ] = False,
    bindings: Bindings = None,
    json: Json = False,
) -> int:
    """Report the errors of model files, and warnings about models that load."""
    if bindings is not None and len(models) > 1:
        message = f"bindings are of one model, and these are {len(models)}"
        remedy = "check each model with its own bindings"
        raise option_error("--bindings", message, remedy)
    loaded = [_load(path, quiet=json) for path in models]  # all errors come before the first exploration
    limits = THOROUGH if thorough else CheckLimits()
    reports = [
        read if isinstance(read, dict) else _check(path, *read, limits, bindings, quiet=json)
        for path, read in zip(models, loaded, strict=True)
    ]
    if json:
        write_json({"format_version": FORMAT_VERSION, "models": reports})
    if any(report["errors"] or report.get("bindings", {}).get("errors") for report in reports):
        return 2
    return 1 if strict and any(report["warnings"] for report in reports) else 0


def _load(path: Path, *, quiet: bool) -> tuple[BehaviorModel, Places] | dict[str, Any]:
    """Return a model with the places of its parts, or the report of its errors."""
    try:
        return load_located(path)
    except InputError as error:
        if not quiet:
            errors().diagnostics(error.diagnostics)
        return {"file": str(path), "errors": [_json(fault) for fault in error.diagnostics], "warnings": []}


def _check(
    path: Path, model: BehaviorModel, places: Places, limits: CheckLimits, bindings: Path | None, *, quiet: bool
) -> dict[str, Any]:
    out, doubts, shown = results(), list[Doubt](), list(places.warnings)
    for warning in () if quiet else shown:
        out.diagnostics([warning])  # one at a time: the number of all warnings follows the last one

    def found(doubt: Doubt) -> None:
        doubts.append(doubt)
        if not quiet and model.objects is None:  # instances have the same doubts, which are folded when all are known
            shown.append(_warning(doubt, places))
            out.diagnostics(shown[-1:])

    with activity_display(f"checking {model.name}") as activity:
        checked = check_model(model, limits, found, activity, today())
    if not quiet:
        for warning in _folded(doubts, places) if model.objects is not None else ():
            shown.append(warning)
            out.diagnostics([warning])
        out.line(f"{path}: {count_of(shown) or 'good'}")
        for sentence in _summary(model, checked):
            out.prose(sentence)
        if _is_unchecked(model):
            out.prose(_UNCHECKED)
        if checked.unfinished:
            remedy = "" if limits is THOROUGH else "; --thorough explores on"
            out.prose(f"  not finished: {', '.join(checked.unfinished)}{remedy}")
    bound = {} if bindings is None else {"bindings": _check_bindings(bindings, model, quiet=quiet)}
    return {
        "file": str(path),
        "errors": [],
        "warnings": [*map(_json, places.warnings), *_listed(doubts, places, Severity.WARNING)],
        "notes": _listed(doubts, places, Severity.NOTE),
        "model": model.name,
        "initial_states": checked.initial_states,
        "reachable": checked.reachable,
        "complete": checked.complete,
        "unfinished": list(checked.unfinished),
        **({"bindings_checked": False} if _is_unchecked(model) else {}),
        **bound,
    }


_UNCHECKED = "  bindings not checked: extra `dds`"


def _is_unchecked(model: BehaviorModel) -> bool:
    """Return whether bindings are only kept: nothing knows the types of ROS 2."""
    return any(type(resource.binding) is Binding for resource in model.resources)


def _check_bindings(path: Path, model: BehaviorModel, *, quiet: bool) -> dict[str, Any]:
    """Return the errors of a bindings file for a model that loads, and the names of the bound resources."""
    try:
        bound = load_bindings(path, model)
    except InputError as error:
        if not quiet:
            errors().diagnostics(error.diagnostics)
        return {"file": str(path), "errors": [_json(fault) for fault in error.diagnostics]}
    real = [resource.name for resource in bound.resources if resource.binding is not None]
    if not quiet:
        out = results()
        out.line(f"{path}: good")
        listed = f": {', '.join(real)}" if real else ""
        out.prose(f"  {model.name}: {counted(len(real), 'bound resource')} of {len(model.resources)}{listed}")
        if _is_unchecked(bound):
            out.prose(_UNCHECKED)
    unchecked = {"bindings_checked": False} if _is_unchecked(bound) else {}
    return {"file": str(path), "errors": [], "bound": real, **unchecked}


def _warning(doubt: Doubt, places: Places) -> Diagnostic:
    """Return the warning for a doubt; its remedy has the names that the text at its place can use."""
    place, line = places.find(doubt.path)
    instance, remedy = places.instance(doubt.path), doubt.remedy
    if instance is not None and remedy is not None:
        remedy = places.in_entry(remedy, instance)
    return Diagnostic(doubt.slug, doubt.message, place, remedy, line, doubt.severity)


def _listed(doubts: Sequence[Doubt], places: Places, severity: Severity) -> list[dict[str, Any]]:
    kept = (doubt for doubt in doubts if doubt.severity is severity)
    return [_json(_warning(doubt, places)) | _origin(doubt, places) for doubt in kept]


def _origin(doubt: Doubt, places: Places) -> dict[str, str]:
    instance = places.instance(doubt.path)
    return {} if instance is None else {"origin": instance.entry}


def _folded(doubts: Sequence[Doubt], places: Places) -> Iterator[Diagnostic]:
    """Yield the warnings for doubts; those about instances of one entry that differ only in objects become one."""
    groups: dict[object, list[Doubt]] = {}
    for index, doubt in enumerate(doubts):
        instance = places.instance(doubt.path)
        key: object = index
        if instance is not None:
            alike = places.without_objects(places.in_entry(doubt.message, instance))
            key = (doubt.slug, doubt.path[0], doubt.path[2:], instance.entry, alike)
        groups.setdefault(key, []).append(doubt)
    for first, *others in groups.values():
        warning, instance = _warning(first, places), places.instance(first.path)
        count = 1 + len(others)
        if instance is not None and count == instance.count:
            number = f" ({count} instances)" if others else ""
            warning = replace(warning, message=f"{places.in_entry(first.message, instance)}{number}")
        elif instance is not None and others:
            number = f"{count} of {instance.count} instances of `{instance.entry}`"
            warning = replace(warning, message=f"{first.message} ({number})")
        yield warning


def _json(diagnostic: Diagnostic) -> dict[str, Any]:
    return {
        "slug": diagnostic.slug.value,
        "message": diagnostic.message,
        "file": diagnostic.place.file,
        "line": diagnostic.place.line,
        "column": diagnostic.place.column,
        "remedy": diagnostic.remedy,
    }


def _summary(model: BehaviorModel, checked: Checked) -> tuple[str, str]:
    obligations = Obligations.of(model).counted.bit_count()
    at_least = "" if checked.complete else "at least "
    parts = [
        counted(len(model.variables), "variable"),
        counted(len(model.resources), "resource"),
        counted(len(model.operations), "operation"),
        counted(len(model.automatic_transitions), "automatic transition"),
        counted(len(model.goals), "goal"),
        counted(len(model.requirements), "requirement"),
    ]
    reach = [
        f"{counted(obligations, 'obligation')} of SCBM-IAS",
        f"{at_least}{counted(checked.initial_states, 'initial state')}",
        f"{at_least}{counted(checked.reachable, 'planning state')} reachable from the nominal one",
    ]
    return f"  {model.name}: {', '.join(parts)}", f"  {', '.join(reach)}"
