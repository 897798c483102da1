"""The HTML report as one file: filled templates, styles, scripts, and the data for the scripts.

The data about cases are columns of the list, details, and visitors of obligations.
"""

from __future__ import annotations

from itertools import chain, islice
from json import dumps
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from msgspec.structs import replace

from scbm.cases.coverage import growth, only_by
from scbm.model.visible_text import counted, escaped, escaped_data
from scbm.reports.figure_table import STATUS_MARKS
from scbm.reports.html.cell_strip import strip_rows
from scbm.reports.html.diagrams import growth_svg, lifecycle_parts
from scbm.reports.html.timelines import pack_timelines
from scbm.reports.html.views import MAX_NAMED, ReportView, Visitors, breakable, fragment, prose
from scbm.reports.run_changes import NO_EARLIER_RUN, run_in_words
from scbm.reports.stored_cases import again, causes_of, place_of, replay_command, sort_of_place, why_no_smallest
from scbm.store import Written

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Hashable, Iterable, Iterator

    from scbm.store import History, SmallestCase, StoredCase
    from scbm.testing import Execution


def case_columns(history: History, visitors: Visitors) -> dict[str, Any]:
    """Return all cases, column by column, with the lists that the columns refer to by index.

    - `obligations`: `[subject, aspect]` for each, in the order of their bits;
    - `goal`, `end`, `set`, `place`: indices into `goals`, `ends`, `sets` and `places`;
    - `places`: where cases ran, in short and in full; the full text is empty for simulation;
    - `sets`: the visited obligations as hexadecimal digits, lowest first; digit i is for obligations 4 i to 4 i + 3;
    - `visits`, `only`: number of obligations in the figure that a case visits, and of those that no other case visits;
    - `marks`: one character for the status of each obligation;
    - `strip`: the aspect of each row in the picture of all obligations;
    - `visitors`: number of cases that visit each obligation;
    - `smallest`: `[index of its timeline, sizes, command, what matters]` of smallest cases, by the number of the cause;
    - `no_smallest`: why a failed case has none, by the index of the case as text;
    - `failures`: `[kind, subject, message, number of the cause]` for each failure, by the index of the case as text.
    """
    cases = history.cases
    counted = history.obligations.counted
    numbers = {
        (label, cause.failure.kind, cause.failure.subject): number
        for number, cause in enumerate(causes_of(history))
        for label in cause.labels
    }
    goals, goal = _numbered(case.goal for case in cases)
    ends, end = _numbered(case.verdict.end.replace("_", " ") for case in cases)
    places, place = _numbered((sort_of_place(case), place_of(case, history)) for case in cases)
    sets, visited = _numbered(f"{case.visited:x}"[::-1] for case in cases)
    return {
        "model": history.model.name,
        "obligations": [[obligation.subject, obligation.aspect] for obligation in history.obligations],
        "operations": [operation.name for operation in history.model.operations],
        "goals": goals,
        "ends": ends,
        "sets": sets,
        "places": places,
        "label": history.labels,
        "goal": goal,
        "end": end,
        "set": visited,
        "place": place,
        "ended_ns": [case.ended_ns for case in cases],
        "requests": [case.requests for case in cases],
        "visits": [(case.visited & counted).bit_count() for case in cases],
        "marks": [STATUS_MARKS[entry.marked] for entry in history.statuses.entries],
        "strip": [aspect for aspect, _ in strip_rows(history.model)],
        "visitors": [len(cases) for cases in visitors.by_bit],
        "only": [(alone & counted).bit_count() for alone in only_by(history.coverage)],
        "smallest": {
            str(number): [len(cases) + place, small.sizes, replay_command(small), small.what_matters]
            for place, (number, small) in enumerate(_smallest_cases(history).items())
        },
        "no_smallest": {
            str(index): why_no_smallest(case, history.runs)
            for index, case in enumerate(cases)
            if not (case.verdict.passed or case.is_lost)
        },
        "failures": {
            str(index): [
                [failure.kind, failure.subject, failure.message, numbers[label, failure.kind, failure.subject]]
                for failure in case.verdict.failures
            ]
            for index, (label, case) in enumerate(zip(history.labels, cases, strict=True))
            if not case.verdict.passed
        },
    }


def case_details(history: History) -> dict[str, Any]:
    """Return the details of cases: `commands` of all cases, and `texts` and `paths` of written cases by index."""
    file = history.source.path
    texts = {str(i): c.recipe.text for i, c in enumerate(history.cases) if isinstance(c.recipe, Written)}
    paths = {str(i): c.recipe.path for i, c in enumerate(history.cases) if isinstance(c.recipe, Written)}
    return {"commands": [again(case, file, history.runs) for case in history.cases], "texts": texts, "paths": paths}


def _numbered(values: Iterable[Hashable]) -> tuple[list[Hashable], list[int]]:
    """Return the distinct values in order of first use, and for each value its index among them."""
    numbers: dict[Hashable, int] = {}
    column = [numbers.setdefault(value, len(numbers)) for value in values]
    return list(numbers), column


def _smallest_cases(history: History) -> dict[int, SmallestCase]:
    """Return the smallest cases by the numbers of their causes, in the order in which their timelines are packed."""
    causes = enumerate(causes_of(history))
    return {number: cause.smallest for number, cause in causes if cause.smallest is not None}


_STYLES = ("page.css", "timeline.css")
_SCRIPTS = ("timeline.js", "page.js")


def html_report(
    history: History,
    replay: Callable[[StoredCase], Execution | None],
    progress: Callable[[int, int], None] | None = None,
) -> str:
    """Return the complete HTML file as text; equal histories give equal files.

    Args:
        history: the history to show, with at least one run.
        replay: runs a case again for its timeline; returns `None` for a case that cannot be run again.
        progress: callback after each of these runs, with the number of finished runs and of all runs.
    """
    environment = page_environment()
    visitors = Visitors.of(history)
    executions = _executions(history, _with_timelines(history, visitors), replay, progress)
    text = environment.get_template("page.html.j2").render(
        lifecycle_parts=Markup(lifecycle_parts(history)),  # noqa: S704 - our own SVG, in which names are escaped
        report=ReportView(history, visitors),
        growth=Markup(growth_svg(history)),  # noqa: S704 - our own SVG, in which names are escaped
        styles=[verbatim(environment, name) for name in _STYLES],
        scripts=[verbatim(environment, name) for name in _SCRIPTS],
        columns=as_json(case_columns(history, visitors)),
        details=as_json(case_details(history)),
        timelines=as_json(pack_timelines(history.model, executions)),
    )
    return escaped(text)


def as_json(value: Any) -> Markup:  # noqa: ANN401 - any value that JSON can represent
    """Return `value` as JSON that is safe inside `<script>`: no text in it ends the element or begins a comment."""
    text = dumps(escaped_data(value), separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)  # noqa: S704 - all characters with a meaning in HTML are escaped


def page_environment() -> Environment:
    """Return the environment of the templates of this package: everything that is filled in is escaped."""
    environment = Environment(
        loader=PackageLoader("scbm.reports", "html"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["breakable"] = breakable
    environment.filters["fragment"] = fragment
    environment.filters["prose"] = prose
    environment.filters["counted"] = counted
    environment.filters["run_in_words"] = run_in_words
    environment.globals["no_earlier_run"] = NO_EARLIER_RUN
    return environment


def verbatim(environment: Environment, name: str) -> Markup:
    """Return the text of a style sheet or a script of this package, unchanged."""
    assert environment.loader is not None  # noqa: S101 - given above
    text, _, _ = environment.loader.get_source(environment, name)
    return Markup(text)  # noqa: S704 - our own file


_MAX_TIMELINES = 1_000
"""Maximum number of timelines; of more cases those have one that other pages name, as running all again takes long."""


def _with_timelines(history: History, visitors: Visitors) -> frozenset[int]:
    """Return the indices of the cases that have a timeline, those with failures and those that added first."""
    if len(history.cases) <= _MAX_TIMELINES:
        return frozenset(range(len(history.cases)))
    by_label = {label: index for index, label in enumerate(history.labels)}
    failed = (by_label[label] for cause in causes_of(history) for label in cause.labels[:MAX_NAMED])
    added = (step.number - 1 for step in growth(history.coverage))
    visiting = (index for cases in visitors.by_bit for index in cases[:MAX_NAMED])
    return frozenset(islice(dict.fromkeys(chain(failed, added, visiting)), _MAX_TIMELINES))


def _executions(
    history: History,
    shown: Container[int],
    replay: Callable[[StoredCase], Execution | None],
    progress: Callable[[int, int], None] | None,
) -> Iterator[Execution | None]:
    for done, case in enumerate(history.cases, start=1):
        yield replay(case) if done - 1 in shown else None
        if progress is not None:
            progress(done, len(history.cases))
    causes = causes_of(history)
    for number, small in _smallest_cases(history).items():
        case = causes[number].case
        yield replay(replace(case, recipe=Written(small.text, small.path), log=None))
