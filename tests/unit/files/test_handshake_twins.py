"""Wrong models that are written with handshakes have the errors of their twins, at the words that people wrote."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from scbm.files import read_model
from scbm.files.yaml.yaml_writer import dump
from scbm.model import Diagnostic, InputError
from support.profiles import slow_where

REJECTED = sorted((Path(__file__).parents[2] / "models" / "rejected").glob("*.yaml"))
RESOURCE = "twin"
LONG = {"guard": "g", "effects": "a", "on_timeout": "timedout"}
"""The keys of handshakes, and those of the twin: errors name the key that is written."""


def data_of(path: Path) -> dict[str, Any] | None:
    """The data of a rejected model; `None` if it is not YAML, or has no operations that can be written in short."""
    try:
        data = YAML(typ="safe").load(path.read_bytes().decode("utf-8-sig"))
    except (YAMLError, ValueError):
        return None
    operations = data.get("operations") if isinstance(data, dict) else None
    is_whole = isinstance(operations, dict) and any(map(is_plain, operations.values()))
    return data if is_whole and isinstance(data.get("resources", {}), dict) else None


def is_plain(operation: object) -> bool:
    """Whether an operation has two transitions with guards, so that it can be written in short."""
    transitions = [operation.get("pre"), operation.get("post")] if isinstance(operation, dict) else [None]
    return all(isinstance(transition, dict) and "g" in transition for transition in transitions)


def short(operation: dict[str, Any]) -> dict[str, Any]:
    """The operation with a request, and its guard and its effects under the keys of a handshake."""
    pre, post = dict(operation["pre"]), dict(operation["post"])
    parts = {"request": RESOURCE, "guard": pre.pop("g")}
    parts |= {"effects": post.pop("a")} if "a" in post else {}
    parts |= {"on_timeout": operation["timedout"]} if "timedout" in operation else {}
    rest = {key: value for key, value in operation.items() if key not in ("pre", "post", "timedout")}
    return parts | rest | {"pre": pre, "post": post}


def twins(path: Path) -> tuple[str, str]:
    """The model with a resource that it does not use, and the same model with handshakes."""
    data = data_of(path)
    assert data is not None
    resources = {**data.get("resources", {}), RESOURCE: {}}
    operations = data["operations"]
    shortened = {name: short(each) if is_plain(each) else each for name, each in operations.items()}
    long = {**data, "resources": resources}
    return dump(long), dump({**long, "operations": shortened})


def diagnostics_of(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as raised:
        read_model(text)
    return raised.value.diagnostics


def errors_of(text: str) -> list[tuple[str, str, str]]:
    """What the errors of a text say, and the words that they underline, whatever their order."""
    lines = text.splitlines()
    found = []
    for each in diagnostics_of(text):
        line = lines[each.place.line - 1] if each.place.line else ""
        words, message = line[each.place.column - 1 :][: each.place.length], each.message
        for key, of_twin in LONG.items():
            message = message.replace(f"under `{key}`", f"under `{of_twin}`")
        found.append((each.slug.value, message, LONG.get(words, words)))
    return sorted(found)


TWINS = [path for path in REJECTED if data_of(path) is not None]


def _is_large(path: Path) -> bool:
    return path.stem == "too-many-instances_entries"


def test_there_are_many_twins() -> None:
    assert len(TWINS) >= 30


@pytest.mark.parametrize("path", slow_where(_is_large, TWINS), ids=lambda path: path.stem)
def test_a_short_twin_has_the_same_errors_at_the_same_words(path: Path) -> None:
    long, lifted = twins(path)
    assert errors_of(lifted) == errors_of(long)
