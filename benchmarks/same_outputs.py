"""Compare the outputs of two versions of scbm: `same_outputs.py --old OLD_PYTHONPATH --new NEW_PYTHONPATH`.

Each campaign is a list of commands in a directory of its own. Both versions run it with the inputs of this repository.
Then the exit codes, the JSON on standard output and all files that the commands wrote are compared: traces, cases,
certificates, coverage stores, and reports that other tools read. Differences are listed with their place; the exit
code is 1 if there is any. `MASKS` lists what is not compared, and why.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import pkgutil
import re
import runpy
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

ROOT = Path(__file__).parents[1]
LINKED = ("examples", "tests", "docs")
"""What the commands find in their directory, from the root of the repository."""


@dataclass(frozen=True)
class Mask:
    """A part of an output that may differ between two versions."""

    where: str
    """Members of objects (`json`, `token`, `added`), names of files, attributes of XML, columns of stores, or text."""
    names: tuple[str, ...]
    why: str


MASKS = (
    Mask("json", ("message", "remedy", "reason", "text", "failures", "note"), "prose"),
    Mask("json", ("shortDescription", "fullDescription", "help", "markdown"), "prose"),
    Mask("added", ("description", "title"), "prose; a version may describe more keys than another"),
    Mask("file", ("last-failed.json",), "files that only one version writes"),
    Mask("json", ("semanticVersion", "scbm_version"), "version"),
    Mask("json", ("guid", "correlationGuid"), "run tokens"),
    Mask("token", ("id", "run"), "run tokens, 32 hexadecimal digits"),
    Mask("json", ("started", "startTimeUtc", "endTimeUtc"), "wall clock"),
    Mask("xml", ("version",), "version"),
    Mask("xml", ("timestamp",), "wall clock"),
    Mask("xml", ("message",), "prose"),
    Mask("xml", ("text()",), "prose"),
    Mask("store", ("token",), "run tokens"),
    Mask("store", ("started",), "wall clock"),
    Mask("store", ("failures",), "prose"),
    Mask("text", (r"run_?[0-9a-f]{32}", r"\b[0-9a-f]{32}-\d+\b"), "run tokens"),
    Mask("text", (r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?Z?",), "wall clock"),
)
"""Everything else is compared: names, slugs, values, states, plans, times of runs, figures, and the order of all."""

PROSE_FILES = (".txt", ".md", ".html", ".svg")
"""Reports for people: only that they are written counts."""


def masked(where: str) -> frozenset[str]:
    """Return the names of a kind of output that are not compared."""
    return frozenset(name for mask in MASKS if mask.where == where for name in mask.names)


_JSON, _XML, _STORE, _TOKEN = masked("json"), masked("xml"), masked("store"), masked("token")
_ADDED, _FILE = masked("added"), masked("file")
_TOKEN_VALUE = re.compile(r"[0-9a-f]{32}")
_TEXT = re.compile("|".join(pattern for mask in MASKS if mask.where == "text" for pattern in mask.names))


# The campaigns

RANDOM_MODELS = range(1, 16)
"""Numbers of models of `tests/support/random_models.py`."""


@dataclass(frozen=True)
class Campaign:
    """Commands that run one after the other in one directory."""

    name: str
    commands: tuple[tuple[str, ...], ...]


def campaigns() -> list[Campaign]:
    """Return all campaigns; the first word `scbm` of their commands is left out."""
    return [
        *_example_campaigns(),
        *_example_runs(),
        *_corpus_campaigns("valid"),
        *_corpus_campaigns("fails_at_run"),
        *(_model_campaign(f"random-{number}", f"models/{number}.yaml") for number in RANDOM_MODELS),
        *_other_campaigns(),
    ]


EXAMPLES = {name: f"examples/robot_in_the_air/{name}.yaml" for name in ("before", "after")}
NETWORKS = {
    "perfect": (),
    "losses": ("--network", "loss: 5 %, duplication: 10 %, reordering: 20 %, latency: 5 ms, jitter: 20 ms"),
    "drawn": ("--network", "drawn"),
}


def _campaign(name: str, *commands: str | Sequence[str]) -> Campaign:
    return Campaign(name, tuple(tuple(words.split() if isinstance(words, str) else words) for words in commands))


def _example_campaigns() -> Iterator[Campaign]:
    for name, model in EXAMPLES.items():
        for network, options in NETWORKS.items():
            for seed in ("1", "7"):
                test = ("test", model, "--cases", "20", "--seed", seed, "--json", *options)
                yield _campaign(
                    f"test-{name}-{network}-{seed}",
                    (*test, "--store", "a.db", "--save", "cases"),
                    "report a.db --json --contexts --cobertura c.xml --junit j.xml --lcov l.info --sarif s.sarif",
                    "report a.db --json --minimize --save smallest",
                )
        yield _campaign(f"close-{name}", f"close {model} --json --out closed", "close --check --json closed")
        yield _campaign(
            f"close-{name}-suite",
            f"test {model} --cases 20 --seed 3 --json --save cases",
            f"close {model} --suite cases --json --out closed",
            f"test {model} cases closed --json --store a.db",
        )


def _example_runs() -> Iterator[Campaign]:
    goals = ("item_a_scanned", "item_a_delivered", "robot_at == agv && mounted == gripper")
    for name, model in EXAMPLES.items():
        for network, options in NETWORKS.items():
            runs = [
                (
                    *("run", model, "--goal", goal, "--seed", str(seed), "--json"),
                    *("--trace", f"{number}-{seed}.trace", *options),
                )
                for number, goal in enumerate(goals)
                for seed in range(3)
            ]
            plans = [("plan", model, "--goal", goal, "--json") for goal in goals]
            yield _campaign(f"run-{name}-{network}", *plans, *runs)
    yield _campaign(
        "state-before",
        f"plan {EXAMPLES['before']} --goal item_a_delivered --state robot_at=agv --state mounted=scanner --json",
        f"plan {EXAMPLES['before']} --goal item_a_delivered --max-expanded 5 --json",
        f"run {EXAMPLES['before']} --goal item_a_scanned --state gantry_at=agv --json --time-limit 3s",
    )


def _corpus_campaigns(folder: str) -> Iterator[Campaign]:
    for path in sorted((ROOT / "tests/models" / folder).glob("*.yaml")):
        yield _model_campaign(f"{folder}-{path.stem}", path.relative_to(ROOT).as_posix())


def _model_campaign(name: str, model: str) -> Campaign:
    return _campaign(
        name,
        f"check --json {model}",
        f"test {model} --cases 10 --seed 1 --json --store a.db --failures failures",
        f"test {model} --cases 10 --seed 2 --network drawn --json --store b.db --failures failures --no-shrink",
        "combine a.db b.db -o both.db --json",
        "report both.db --json --cobertura c.xml --junit j.xml --lcov l.info --sarif s.sarif",
        f"close {model} --json --out closed",
        f"plan {model} --goal true --json",
        f"run {model} --case 1 --seed 1 --json --trace a.trace",
    )


def _other_campaigns() -> Iterator[Campaign]:
    before = EXAMPLES["before"]
    rejected = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "tests/models/rejected").glob("*.yaml"))
    yield _campaign("check-rejected", ("check", "--json", *rejected), "check --json docs/wrong.yaml")
    yield _campaign("schema", "schema", "schema case")
    yield _campaign(
        "requirements-before",
        (
            *f"test {before} --cases 20 --seed 5 --json --store a.db --failures failures --network drawn".split(),
            *("--require", "never mounted == scanner && gripper_act == closed"),
        ),
        ("run", before, "--goal", "item_a_delivered", "--json", "--require", "never robot_at == agv"),
        "report a.db --json --sarif s.sarif --junit j.xml",
    )
    yield _campaign(
        "replay-before",
        f"test {before} --cases 4 --seed 9 --network drawn --json --save cases",
        *(f"replay cases/seed-9-case-{number}.yaml --json --trace {number}.trace" for number in range(1, 5)),
        *(f"trace cases/seed-9-case-{number}.yaml --json --perfetto {number}.json" for number in range(1, 3)),
    )
    yield _campaign(
        "explain-before",
        *(
            f"explain {before} {name} --json"
            for name in ("robot_unmount_gripper", "scanner_scan_item_a/timedout", "automatic/gripper_failed")
        ),
    )
    yield _campaign(
        "case-files-after",
        f"test {EXAMPLES['after']} examples/robot_in_the_air/cases --json --store a.db",
        f"close {EXAMPLES['after']} --suite examples/robot_in_the_air/cases --json",
    )
    yield _campaign("fail-under-after", f"test {EXAMPLES['after']} --cases 5 --seed 1 --json --fail-under 90")


# One version runs all campaigns


def write_random_models(directory: Path, source: Path) -> None:
    """Write the files of `RANDOM_MODELS` into `directory`, by the package in `source`: both versions read them."""
    sys.path[:0] = [str(source.resolve()), str(ROOT / "tests")]
    from scbm.files import write_model  # noqa: PLC0415 - found only now
    from support.random_models import random_model  # noqa: PLC0415 - the same

    directory.mkdir(parents=True)
    for number in RANDOM_MODELS:
        (directory / f"{number}.yaml").write_text(write_model(random_model(number)), encoding="utf-8")


def run_all(names: Sequence[str], directory: Path) -> None:
    """Run campaigns with the package that this process imports; outputs go to `directory`."""
    package = importlib.import_module("scbm")
    for module in pkgutil.walk_packages(package.__path__, "scbm."):
        if module.name != "scbm.__main__":
            with suppress(ImportError):  # of an extra that is not installed
                importlib.import_module(module.name)
    for campaign in campaigns():
        if campaign.name in names:
            place = directory / campaign.name
            place.mkdir(parents=True)
            for linked in LINKED:
                (place / linked).symlink_to(ROOT / linked)
            (place / "models").symlink_to(directory.parent / "models")
            for number, words in enumerate(campaign.commands, start=1):
                _run(words, place, f"{number:02}")


def _run(words: Sequence[str], place: Path, number: str) -> None:
    """Run a command in a process forked from this one, as importing the package takes longer than most commands."""
    child = os.fork()
    if child:
        _, status = os.waitpid(child, 0)
        (place / f"{number}.exit.json").write_text(str(os.waitstatus_to_exitcode(status)), encoding="utf-8")
        return
    code = 3
    try:
        os.chdir(place)
        for stream, descriptor in (("stdout", 1), ("stderr", 2)):
            opened = os.open(f"{number}.{stream}", os.O_WRONLY | os.O_CREAT)
            os.dup2(opened, descriptor)
        sys.argv = ["scbm", *words]
        runpy.run_module("scbm", run_name="__main__", alter_sys=False)
        code = 0
    except SystemExit as exited:
        code = exited.code if isinstance(exited.code, int) else bool(exited.code)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


# Outputs as values that can be compared


def outputs(place: Path) -> dict[str, object]:
    """Return what a campaign wrote, by path: as values with masked parts replaced."""
    found = sorted(path for path in place.rglob("*") if path.is_file() and not _is_left_out(path, place))
    return {path.relative_to(place).as_posix(): _value(path) for path in found}


def _is_left_out(path: Path, place: Path) -> bool:
    return path.name in _FILE or (place / path.relative_to(place).parts[0]).is_symlink()


def _value(path: Path) -> object:
    if path.suffix == ".db":
        return dict(_tables(path))
    if path.suffix in PROSE_FILES or path.suffix == ".stderr":
        return "written"
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".xml":
        return _xml(ET.fromstring(text))  # noqa: S314 - we wrote it
    if path.suffix == ".yaml":
        return _text(re.sub(r"(?m)^\s*#.*\n", "", text)).splitlines()
    return _json_or_text(text, is_prose=path.suffix == ".stdout")


def _json_or_text(text: str, *, is_prose: bool) -> object:
    with suppress(ValueError):
        value = json.loads(text)
        is_schema = isinstance(value, dict) and "$defs" in value
        return _json(_inlined(value, value["$defs"]) if is_schema else value)
    lines = text.splitlines()
    try:
        return [_json(json.loads(line)) for line in lines]
    except ValueError:
        return "written" if is_prose else _text(text).splitlines()


def _inlined(value: object, definitions: Mapping[str, object]) -> object:
    """Return a JSON Schema with its definitions where they are used, and its members sorted: their order is free."""
    if isinstance(value, list):
        return [_inlined(member, definitions) for member in value]
    if not isinstance(value, dict):
        return value
    members = {name: _inlined(member, definitions) for name, member in sorted(value.items()) if name != "$defs"}
    name = str(members.pop("$ref", "")).removeprefix("#/$defs/")
    used = _inlined(definitions.get(name), definitions)
    return {**used, **members} if isinstance(used, dict) else members


def _json(value: object) -> object:
    if isinstance(value, dict):
        return {
            _text(str(name)): _member(name, member)
            for name, member in value.items()
            if not (name in _ADDED and isinstance(member, str))
        }
    if isinstance(value, list):
        return [_json(member) for member in value]
    return _text(value) if isinstance(value, str) else value


def _member(name: str, value: object) -> object:
    if name in _TOKEN and isinstance(value, str):
        return _TOKEN_VALUE.sub("…", value)
    return _masked(value) if name in _JSON else _json(value)


def _masked(value: object) -> object:
    """Hide strings; how many there are, and everything within objects, is still compared."""
    if isinstance(value, list):
        return [_masked(member) for member in value]
    return "…" if isinstance(value, str) else _json(value)


def _text(value: str) -> str:
    return _TEXT.sub("…", value)


def _xml(element: ET.Element) -> object:
    attributes = {name: "…" if name in _XML else _text(value) for name, value in element.attrib.items()}
    return {element.tag: attributes, "children": [_xml(child) for child in element]}


def _tables(path: Path) -> Iterator[tuple[str, object]]:
    connection = sqlite3.connect(path)
    tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name").fetchall()
    for (table,) in tables:
        cursor = connection.execute(f'SELECT * FROM "{table}"')  # noqa: S608 - a name from the schema
        columns = [column[0] for column in cursor.description]
        rows = [
            {column: _cell(column, cell) for column, cell in zip(columns, row, strict=True)}
            for row in cursor.fetchall()
        ]
        yield table, sorted(rows, key=repr)
    connection.close()


def _cell(column: str, cell: object) -> object:
    if column in _STORE and cell is not None:
        return "…"
    if isinstance(cell, bytes):
        return cell.hex()
    return _text(cell) if isinstance(cell, str) else cell


# Comparison


def differences(old: object, new: object, place: str = "") -> Iterator[str]:
    """Yield a line for each place in which two values differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        if list(old) != list(new) and set(old) == set(new):
            yield f"{place}: another order of members: {', '.join(old)} / {', '.join(new)}"
        for name in [*old, *(name for name in new if name not in old)]:
            yield from differences(old.get(name, _MISSING), new.get(name, _MISSING), f"{place}.{name}")
    elif isinstance(old, list) and isinstance(new, list):
        for index, (one, other) in enumerate(zip_longest(old, new, fillvalue=_MISSING)):
            yield from differences(one, other, f"{place}[{index}]")
    elif type(old) is not type(new) or old != new:
        yield f"{place}: {_shown(old)} / {_shown(new)}"


_MISSING = object()


def _shown(value: object) -> str:
    return "nothing" if value is _MISSING else repr(value)[:120]


def main() -> None:
    """Run the campaigns with both versions, and print what differs."""
    options = _options()
    if options.worker is not None:
        run_all(options.only, options.worker)
        return
    chosen = [campaign for campaign in campaigns() if not options.only or campaign.name in options.only]
    directory = (options.keep or Path(tempfile.mkdtemp(prefix="scbm-same-outputs-"))).resolve()
    names = [campaign.name for campaign in chosen]
    write_random_models(directory / "models", options.new)
    workers = [_start(options.old, directory / "old", names), _start(options.new, directory / "new", names)]
    codes = [worker.wait() for worker in workers]
    if any(codes):
        sys.exit("a version could not run the campaigns")
    files, wrong = 0, 0
    for name in names:
        old, new = outputs(directory / "old" / name), outputs(directory / "new" / name)
        found = list(differences(old, new))
        files += len(old)
        wrong += bool(found)
        for line in found[: options.most]:
            print(f"{name}{line}")
        if len(found) > options.most:
            print(f"{name}: {len(found) - options.most} more differences")
    if options.keep is None:
        shutil.rmtree(directory)
    _summarize(chosen, files, wrong)
    sys.exit(wrong > 0)


def _summarize(chosen: Sequence[Campaign], files: int, wrong: int) -> None:
    by_reason: Mapping[str, list[str]] = {mask.why: [] for mask in MASKS}
    for mask in MASKS:
        by_reason[mask.why] += [f"{mask.where} {name}" for name in mask.names]
    for why, names in by_reason.items():
        print(f"not compared, {why}: {', '.join(names)}")
    commands = sum(len(campaign.commands) for campaign in chosen)
    print(
        f"{len(chosen)} campaigns, {commands} commands, {files} outputs: {len(chosen) - wrong} equal, {wrong} different"
    )


def _start(path: Path, directory: Path, names: Sequence[str]) -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": str(path.resolve()), "COLUMNS": "80", "PYTHONDONTWRITEBYTECODE": "1"}
    words = [sys.executable, __file__, "--worker", str(directory), "--only", *names]
    return subprocess.Popen(words, env=environment)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--old", type=Path, help="the directory `src` of the old version")
    parser.add_argument("--new", type=Path, default=ROOT / "src", help="the directory `src` of the new version")
    parser.add_argument("--only", nargs="*", default=[], metavar="CAMPAIGN", help="run only these")
    parser.add_argument("--most", type=int, default=10, help="how many differences of a campaign to print")
    parser.add_argument("--keep", type=Path, help="keep the outputs in this directory")
    parser.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    main()
