"""The rules of a case for single requests, in the data of its `outcomes` section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_OPEN = "any"
_FEW = 3
"""Maximum number of equal rules in a row that are written one by one."""


class _RuleStretch(NamedTuple):
    """Equal rules in a row.

    Attributes:
        requests: their number; `None` for all that follow.
        rule: what happens to each, as the case says it.
        written: the element of the list, which stays if its requests stay.
    """

    requests: int | None
    rule: Any
    written: Any


def changed_rules(rules: Any, number: int, change: Callable[[dict[str, Any]], None]) -> list[Any]:  # noqa: ANN401 - any data
    """Return the rules of a name with another rule for one request; those of all other requests stay the same.

    Args:
        rules: the data below the name of a resource or of an operation; `None` without any.
        number: the number of the request among those of the name, from 1.
        change: changes the rule of the request, a dictionary, in place.
    """
    found: list[Any] = []
    covered = 0
    is_changed = False
    for count, rule, written in _stretches(rules):
        first, last = covered + 1, number if count is None else covered + count
        if first <= number <= last:
            found += [*_repeated(number - first, rule), _changed(rule, change)]
            found += [_from(rule, number + 1)] if count is None else _repeated(last - number, rule)
            is_changed = True
        else:
            found.append(written)
        covered = last
    return found if is_changed else [*found, *_repeated(number - 1 - covered, _OPEN), _changed(_OPEN, change)]


def _stretches(rules: Any) -> Iterator[_RuleStretch]:  # noqa: ANN401 - any data
    """Yield the rules in order; what they leave open between them is a stretch, too."""
    is_list = isinstance(rules, list)
    number = 1
    for written in rules if is_list else [] if rules is None else [rules]:
        keys = written if isinstance(written, dict) else {}
        rule = _short({k: v for k, v in keys.items() if k not in ("times", "from")}) if keys else written
        if "from" in keys or not is_list:
            begin = max(keys.get("from", 1), number)
            yield from (_RuleStretch(1, _OPEN, _OPEN) for _ in range(begin - number))
            yield _RuleStretch(None, rule, _from(rule, begin) if is_list or begin > 1 else written)
            return
        yield _RuleStretch(keys.get("times", 1), rule, written)
        number += keys.get("times", 1)


def _repeated(count: int, rule: Any) -> list[Any]:  # noqa: ANN401 - any data
    return [rule] * count if count <= _FEW else [{**_as_mapping(rule), "times": count}]


def _from(rule: Any, first: int) -> Any:  # noqa: ANN401 - any data
    return {**_as_mapping(rule), "from": first}


def _changed(rule: Any, change: Callable[[dict[str, Any]], None]) -> Any:  # noqa: ANN401 - any data
    changed = _as_mapping(rule)
    change(changed)
    if changed.get("outcome") == _OPEN and len(changed) > 1:
        del changed["outcome"]
    return _short(changed)


def _short(rule: dict[str, Any]) -> Any:  # noqa: ANN401 - any data
    """Return the word of a rule that says nothing but the outcome."""
    return rule["outcome"] if rule.keys() == {"outcome"} else rule


def _as_mapping(rule: Any) -> dict[str, Any]:  # noqa: ANN401 - any data
    return dict(rule) if isinstance(rule, dict) else {"outcome": rule}
