"""A key that is declared once is checked, read, written, described to editors and documented."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from scbm.files import load_model, open_case, read_bindings, read_network
from scbm.files.codec.case_keys import CaseKeys
from scbm.files.codec.key_types import DURATION, MODEL_NAME, MappingListType, MappingType, NamesType
from scbm.files.codec.keys import DefaultKey, Key, Keys, check_shape
from scbm.files.codec.lifted.object_keys import TableKeys, TypeKeys
from scbm.files.codec.lifted.part_keys import PartUseKeys
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.codec.operation_keys import OperationKeys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.key_reference import json_schema, key_table, mappings_of
from scbm.files.language.scope import Scope
from scbm.files.yaml.error_collector import ErrorCollector
from scbm.files.yaml.text_files import read_tree
from scbm.model import InputError, Slug
from scbm.nodes.bindings.binding_keys import BindingsKeys
from support.shared_models import clear_models
from support.wording import Wording

MODELS = Path(__file__).parent.parent.parent / "models"


@dataclass(frozen=True)
class Pause:
    length_ns: int
    label: str | None = None
    repeats: tuple[tuple[str, int], ...] = ()
    lead_ns: int = 0


class PauseKeys(Keys):
    """A pause."""

    length = Key(DURATION, "How long it lasts.", required=True, source="length_ns")
    label = Key(MODEL_NAME, "What | reports call it.", absent="no name")
    lead = DefaultKey(DURATION, "How long before.", default=0, source="lead_ns")
    repeats = DefaultKey(NamesType(DURATION, "name → duration"), "Further pauses.", default=())

    def pause(self) -> Pause:
        repeats = tuple((entry.name, entry.value or 0) for entry in self.repeats)
        return Pause(self.length or 0, self.label, repeats, self.lead)


class PlanKeys(Keys):
    """A plan of pauses."""

    first = Key(MappingType(PauseKeys), required=True)
    others = DefaultKey(MappingListType(PauseKeys, "list of pauses"), default=())


@pytest.mark.parametrize(
    ("written", "remedy"),
    [
        ("loss=10 %", "write `loss: 10 %`"),
        ("loss = 10 %", "write `loss: 10 %`"),
        ("loss:10 %", "write `loss: 10 %`"),
        ("loss 10 %", "write `loss: 10 %`"),
        ("los=10 %", "write `loss: 10 %`"),
        ("duplicaton", "did you mean `duplication`?"),
    ],
)
def test_a_key_with_its_value_is_shown_as_it_is_written(written: str, remedy: str) -> None:
    model = load_model(MODELS / "valid" / "waivers.yaml")
    with pytest.raises(InputError) as raised:
        read_network(f"{written}, jitter=5 ms", model)
    first, second = raised.value.diagnostics
    assert (first.slug, first.remedy) == (Slug.UNKNOWN_KEY, remedy)
    assert (second.place.column, second.remedy) == (len(written) + 3, "write `jitter: 5 ms`")


def test_a_text_that_begins_like_no_key_has_the_keys(wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        read_network("10 %", load_model(MODELS / "valid" / "waivers.yaml"))
    wording(raised.value.diagnostics[0].remedy)


def read(text: str) -> tuple[PauseKeys, ErrorCollector]:
    document, _, report = read_tree(text, "file", "pause", "")
    check_shape(document, report, PauseKeys, ((PlanKeys, "a plan"),))
    return PauseKeys(document, ValueReader(report, Scope({}))), report


def slugs(text: str) -> list[tuple[Slug, int]]:
    keys, report = read(text)
    keys.pause()
    if not len(report):
        return []
    return [(found.slug, found.place.column) for found in report.error().diagnostics]


def test_the_values_of_keys_are_attributes() -> None:
    keys, report = read("{length: 2 s, repeats: {again: 3 s}}")
    assert keys.pause() == Pause(2_000_000_000, None, (("again", 3_000_000_000),))
    assert keys.lead == 0
    assert len(report) == 0


def test_a_key_is_read_once() -> None:
    keys, report = read("{length: 2}")
    assert keys.length is None
    assert len(report) == 1
    assert "length" in vars(keys)


def test_what_is_written_is_read_as_the_same_value() -> None:
    pause = Pause(2_000_000_000, "short", (("again", 1),))
    written = PauseKeys.write(pause)
    assert written == {"length": "2 s", "label": "short", "repeats": {"again": "1 ns"}}
    assert read(str(written).replace("'", ""))[0].pause() == pause


def test_a_key_that_says_no_more_than_its_default_is_not_written() -> None:
    assert PauseKeys.write(Pause(0)) == {"length": "0 s"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{length: 2 s}", []),
        ("{label: a}", [(Slug.MISSING_KEY, 1)]),
        ("{lenght: 2 s}", [(Slug.UNKNOWN_KEY, 2)]),
        ("{length: [2 s]}", [(Slug.WRONG_SHAPE, 2)]),
        ("{length: 2 s, repeats: 3}", [(Slug.WRONG_SHAPE, 15)]),
        ("{length: 2 s, repeats: {a: }}", [(Slug.WRONG_SHAPE, 25)]),
        ("{length: 2 s, lead: 2 parsecs}", [(Slug.BAD_DURATION, 21)]),
        ("{length: 2 s, first: 1}", [(Slug.UNKNOWN_KEY, 15)]),
    ],
)
def test_every_deviation_is_an_error_at_its_place(text: str, expected: list[tuple[Slug, int]]) -> None:
    assert slugs(text) == expected


def test_an_unknown_key_that_belongs_elsewhere_is_reported_where(wording: Wording) -> None:
    keys, report = read("{length: 2 s, others: 1}")
    keys.pause()
    with wording.raises(InputError):
        report.raise_any()


def test_the_schema_describes_what_is_declared() -> None:
    schema = json_schema(PlanKeys, "Plans")
    assert schema["title"] == "Plans"
    assert schema["required"] == ["first"]
    assert schema["properties"]["others"]["items"] == {"$ref": "#/$defs/PauseFile"}
    pause = schema["$defs"]["PauseFile"]
    assert list(pause["properties"]) == ["length", "label", "lead", "repeats"]
    assert pause["properties"]["lead"]["default"] == "0 s"
    assert pause["description"] == "A pause."


def test_the_table_has_a_row_for_each_key(wording: Wording) -> None:
    rows = [line.split(" | ") for line in key_table(PauseKeys).splitlines()[2:]]
    assert [row[0] for row in rows] == [f"| `{name}`" for name in ("length", "label", "lead", "repeats")]
    wording(key_table(PauseKeys))


@pytest.mark.parametrize("root", [ModelKeys, CaseKeys, BindingsKeys])
def test_every_mapping_of_a_file_has_a_table(root: type[Keys]) -> None:
    titles = {keys.title() for keys in mappings_of(root)}
    assert titles >= {root.title(), *json_schema(root, "").get("$defs", {})}


@pytest.mark.parametrize("root", [ModelKeys, CaseKeys, BindingsKeys])
def test_every_key_has_a_help_text(root: type[Keys]) -> None:
    for keys in mappings_of(root):
        assert [name for name, key in keys.declared.items() if not key.help_text] == [], keys.title()


def test_every_declared_key_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read: set[tuple[type[Keys], str]] = set()
    get = Key.__get__

    def noting(key: Key[Any], keys: Keys | None, owner: type) -> object:
        if keys is not None:
            read.add((type(keys), key.name))
        return get(key, keys, owner)

    clear_models()  # other tests of this process may have read some of the files
    monkeypatch.setattr(Key, "__get__", noting)
    models = [load_model(path) for path in sorted((MODELS / "valid").glob("*.yaml"))]
    read_bindings(f"{{bindings_of: {models[0].name}, resources: {{}}}}", models[0])
    cell = load_model(MODELS / "cell.yaml")
    for path in sorted((MODELS / "valid_cases").glob("*.yaml")):
        open_case(path).read(cell)
    declared = {
        (keys, name)
        for root in (ModelKeys, CaseKeys, BindingsKeys)
        for keys in mappings_of(root)
        for name in keys.declared
    }
    as_transitions: set[tuple[type[Keys], str]] = {(OperationKeys, name) for name in ("guard", "effects", "on_timeout")}
    of_objects = {(keys, name) for keys, name in declared if name == "where" or keys in (TypeKeys, TableKeys)}
    of_objects |= {(ModelKeys, "types"), (ModelKeys, "tables")}
    parts: set[tuple[type[Keys], str]] = {(ModelKeys, "include"), (ModelKeys, "parts")}
    parts |= {(PartUseKeys, name) for name in PartUseKeys.declared}
    assert declared - read == as_transitions | parts | of_objects
