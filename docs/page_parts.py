"""The generated parts of pages: a page says `<!-- generated: NAME ARGUMENT -->` where one stands.

The site has them (`conf.py`), and so have the pages that tests read. The repository does not keep them.
"""

from __future__ import annotations

import ast
import re
import tomllib
from inspect import cleandoc
from pathlib import Path
from typing import Any, cast, get_args

from ruamel.yaml import YAML

from scbm.cases.trace.records import Record
from scbm.cli.application import verb_options
from scbm.cli.message_sections import messages_text
from scbm.cli.verb_registry import VERBS
from scbm.closing.case_searches import CASE_SEARCHES
from scbm.files.codec.case_keys import CaseKeys
from scbm.files.codec.lifted.part_keys import PartKeys
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.codec.waiver_keys import WaiversKeys
from scbm.files.key_reference import key_table, mappings_of
from scbm.mutation.mutation_operators import MUTATIONS
from scbm.nodes.bindings.binding_keys import BindingsKeys
from scbm.planning.planners import PLANNERS
from scbm.plugins.pytest import pytest_addoption
from scbm.store.store_schema import TABLES

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "scbm"

MAPPINGS = {
    keys.title(): keys
    for root in (ModelKeys, PartKeys, CaseKeys, BindingsKeys, WaiversKeys)
    for keys in mappings_of(root)
}
"""The mappings of files, by the names that their schemas have."""

_MARK = re.compile(r"^<!-- generated: (\w+) ?(.*?) -->$", re.MULTILINE)
_RULE = re.compile(r"^(?=\*\*(\d+)\.(\d+))", re.MULTILINE)
"""The beginning of a rule of the semantics."""
_RULES_LINK = re.compile(r"\[semantics\]\([\w./#-]*\) (\d+\.\d+(?:, \d+\.\d+)*)")
"""A link to the semantics, and the numbers of the rules that are meant."""

_BEGINNING = re.compile(r'"""[^"\\]*"""\n')
"""A docstring that a module begins with."""


def complete_page(text: str) -> str:
    """Return a page with its generated parts."""
    return _MARK.sub(lambda mark: PARTS[mark[1]](mark[2]), text)


def link_rules(text: str) -> str:
    """Return a page in which each rule of the semantics can be linked to, and the numbers of rules are such links."""
    return _RULES_LINK.sub(_rule_links, _RULE.sub(r"(rule-\1-\2)=\n", text))


def _rule_links(link: re.Match[str]) -> str:
    first, *others = (f"[{number}](#rule-{number.replace('.', '-')})" for number in link[1].split(", "))
    return ", ".join([first.replace("[", "[semantics ", 1), *others])


def _keys(mapping: str) -> str:
    """Return the table of the keys of a mapping."""
    return f"\n{key_table(MAPPINGS[mapping])}"


def _verbs(_: str) -> str:
    """Return the table of the verbs, each with a link to its section."""
    rows = (f"| [`{name}`](#scbm-{name.replace(' ', '-')}) | {verb.summary} |\n" for name, verb in VERBS.items())
    return "".join(["| verb | task |\n| --- | --- |\n", *rows])


def _searches(_: str) -> str:
    """Return the table of the searches for cases."""
    rows = (f"| `{name}` | {each.finds} | {each.limit} |\n" for name, each in CASE_SEARCHES.items())
    return "".join(["| search | finds | ends early after |\n| --- | --- | --- |\n", *rows])


def _options(verb: str) -> str:
    """Return the table of the options of a verb, with the texts of its help."""
    rows = []
    for option in verb_options(verb):
        names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
        more = [f"Default: `{option.default}`."] * (type(option.default) in (int, str))
        more += ["May be repeated."] * option.multiple
        value = f" {option.metavar}" if option.metavar else ""
        rows.append(f"| {names}{value} | {' '.join([str(option.help), *more])} |\n")
    return "".join(["\n| option | meaning |\n| --- | --- |\n", *rows])


class _PytestOptions:
    """Stands for the parser of pytest, and notes the options and settings that a plugin adds."""

    def __init__(self) -> None:
        self.rows: list[str] = []

    def getgroup(self, *_: str) -> _PytestOptions:
        return self

    def addoption(self, name: str, **given: Any) -> None:  # noqa: ANN401 - as pytest takes them
        value = given.get("metavar") or ", ".join(given.get("choices", ()))
        self.rows.append(f"| `{name}` {value} | {given['help']} |\n")

    def addini(self, name: str, meaning: str, **_: object) -> None:
        self.rows.append(f"| `{name}` in the configuration | {meaning} |\n")


def _pytest(_: str) -> str:
    """Return the table of the options and settings of the plugin for pytest."""
    options = _PytestOptions()
    pytest_addoption(cast("Any", options))
    return "".join(["\n| option | meaning |\n| --- | --- |\n", *options.rows])


def _planners(_: str) -> str:
    """Return the table of the planners."""
    rows = (f"| `{name}` | {planner.help} |\n" for name, planner in PLANNERS.items())
    return "".join(["\n| planner | plans |\n| --- | --- |\n", *rows])


def _operators(_: str) -> str:
    """Return the table of the mutation operators."""
    rows = (f"| `{each.group}` | `{name}` | {each.summary} |\n" for name, each in MUTATIONS.items())
    return "".join(["\n| group | operator | change |\n| --- | --- | --- |\n", *rows])


def _records(_: str) -> str:
    """Return the table of the kinds of records in a trace, with the fields that each has of its own."""
    rows = []
    for each in get_args(Record):
        own = ", ".join(f"`{name}`" for name in each.__struct_fields__ if name not in {"at_ns", "changes"})
        rows.append(f"| `{each.kind}` | {' '.join(cleandoc(each.__doc__).split())} | {own} |\n")
    return "".join(["\n| kind | event | fields of its own |\n| --- | --- | --- |\n", *rows])


def _tables(_: str) -> str:
    """Return a section for each table of a coverage store, with its columns."""
    lines = []
    for name, table in TABLES.items():
        rows = [f"| `{each.name}` | {each.type.split()[0].lower()} | {each.comment} |" for each in table.columns]
        lines += [f"### {name}", "", table.comment, "", "| column | type | content |", "| --- | --- | --- |", *rows, ""]
    return "\n".join(lines)


def _messages(_: str) -> str:
    """Return the sections of all slugs."""
    return messages_text()


def _modules(_: str) -> str:
    """Return for each package its summary, and a table with a row for each of its modules."""
    lines = []
    for package in _packages():
        name = package.relative_to(SOURCE).as_posix()
        lines += [f"## `{name}`", "", f"{summary(package / '__init__.py')}.", ""]
        modules = [path for path in sorted(package.glob("*.py")) if path.name != "__init__.py"]
        if modules:
            rows = [f"| `{path.stem}` | {summary(path)} |" for path in modules]
            lines += ["| module | contents |", "| --- | --- |", *rows, ""]
    return "\n".join(lines)


def _contracts(_: str) -> str:
    """Return a list of the contracts about imports."""
    configuration = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return "".join(f"- {each['name']}.\n" for each in configuration["tool"]["importlinter"]["contracts"])


def _library(_: str) -> str:
    """Return the table of the parts that come with `scbm`: their comments, variables and parameters."""
    rows = []
    for path in sorted((SOURCE / "files" / "parts").glob("*.yaml")):
        text = path.read_text(encoding="utf-8")
        comment = " ".join(re.findall(r"^# (.*)$", text.partition("\npart:")[0], re.MULTILINE))
        part = YAML(typ="safe").load(text)
        names = (", ".join(f"`{name}`" for name in part[section]) for section in ("variables", "parameters"))
        rows.append(f"| `scbm:{path.stem}` | {comment} | {' | '.join(names)} |\n")
    return "".join(["\n| use | what it is | variables | parameters |\n| --- | --- | --- | --- |\n", *rows])


def _packages() -> list[Path]:
    """Return the packages of the project as directories, each followed by those inside it."""
    found = sorted(path.parent.relative_to(SOURCE) for path in SOURCE.rglob("__init__.py"))
    return [SOURCE / path for path in found if path.parts]


def summary(path: Path) -> str:
    """Return the first sentence of the docstring of a module, as text for a cell of a table."""
    text = path.read_text(encoding="utf-8")
    docstring = _BEGINNING.match(text)  # parsing all of the module takes far longer
    paragraph = (ast.get_docstring(ast.parse(text if docstring is None else docstring[0])) or "").partition("\n\n")[0]
    sentence = re.split(r"(?<=[.?!])\s+(?=[A-Z`])", " ".join(paragraph.split()), maxsplit=1)[0]
    return sentence.removesuffix(".").replace("|", "\\|").replace("<", "\\<")


PARTS = {
    "contracts": _contracts,
    "keys": _keys,
    "library": _library,
    "messages": _messages,
    "modules": _modules,
    "operators": _operators,
    "options": _options,
    "planners": _planners,
    "pytest": _pytest,
    "records": _records,
    "searches": _searches,
    "tables": _tables,
    "verbs": _verbs,
}
"""The generated parts by name; each takes the argument of the mark, which may be empty."""
