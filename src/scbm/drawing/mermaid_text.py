"""Automata and plans as text for Mermaid, which GitHub and GitLab draw within Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.drawing.automata import ANY_OTHER
from scbm.drawing.edge_statuses import NO_PAINT, PAINTS
from scbm.drawing.label_widths import label_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.drawing.drawn_automata import DrawnArrow, DrawnAutomaton
    from scbm.drawing.plan_lanes import PlannedOperation

_PLAIN = " _()+,.-"
"""The characters beside letters and digits that have no meaning for Mermaid within a label."""

_MAX_LINES = 4
"""Maximum number of makers that a label names."""


def mermaid_label(text: str) -> str:
    """Return a text for a label; all characters that Mermaid could read as syntax are entities by their numbers."""
    return _escaped(text, "#{};")


def _escaped(text: str, entity: str) -> str:
    return "".join(
        each if each.isalnum() or each in _PLAIN or not each.isascii() else entity.format(ord(each))
        for each in label_of(text)
    )


def automaton_text(automaton: DrawnAutomaton) -> str:
    """Return an automaton as a `stateDiagram-v2`."""
    return "\n".join(("stateDiagram-v2", *(f"    {line}" for line in _lines(automaton)), ""))


def _lines(automaton: DrawnAutomaton) -> Iterator[str]:
    yield "direction LR"
    for number, node in enumerate(automaton.nodes):
        yield f'state "{mermaid_label(node.label)}" as s{number}'
    if any(each.way.source == ANY_OTHER for each in automaton.arrows):
        yield 'state "any other" as other'
    for number, node in enumerate(automaton.nodes):
        if node.is_nominal:
            yield f"[*] --> s{number}"
    for each in automaton.arrows:
        source = "other" if each.way.source == ANY_OTHER else f"s{each.way.source}"
        yield f"{source} --> s{each.way.target}: {', '.join(_makers(each))}"


def _makers(each: DrawnArrow) -> Iterator[str]:
    for line in each.lines[:_MAX_LINES]:
        yield mermaid_label(f"{PAINTS.get(line.paint, NO_PAINT).mark} {line.text}".lstrip())
    if len(each.lines) > _MAX_LINES:
        yield f"+ {len(each.lines) - _MAX_LINES} more"


def plan_text(steps: Sequence[PlannedOperation]) -> str:
    """Return a plan as a `flowchart`, with a subgraph for each lane."""
    lanes, lines = dict.fromkeys(step.lane for step in steps), ["flowchart LR"]
    for number, lane in enumerate(lanes):
        lines.append(f'    subgraph lane{number}["{mermaid_label(lane)}"]')
        for step in (each for each in steps if each.lane == lane):
            words = [f"{step.number} {step.operation}", *(f"needs {each}" for each in step.needs)]
            label = "<br/>".join(map(mermaid_label, [*words, *(f"sets {each}" for each in step.sets)]))
            lines.append(f'        o{step.number}["{label}"]')
        lines.append("    end")
    lines += [f"    o{step.number} --> o{step.number + 1}" for step in steps[:-1]]
    return "\n".join((*lines, ""))


def fenced(title: str, text: str) -> str:
    """Return a diagram as a part of a page in Markdown, below a title without markup."""
    return f"### {_escaped(title, '&#{};')}\n\n```mermaid\n{text}```\n"


def folded(automaton: DrawnAutomaton) -> str:
    """Return an automaton as a part of a page in Markdown that a click opens."""
    title, text = _escaped(automaton.title, "&#{};"), automaton_text(automaton)
    return f"<details><summary>What changes {title}</summary>\n\n```mermaid\n{text}```\n\n</details>\n"
