"""The layout of the code that docs/explanation/architecture.md describes: packages, sizes of folders, names, words."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from token import NAME
from tokenize import tokenize

import pytest
from code_figures import circles_of_files, lines_of_code

from support.layout_rules import SOURCE, full_folders, repeated_classes, repeated_modules, source_texts
from support.prose_literals import is_prose, prose_literals
from support.quoted_names import QuotedNames

ROOT = Path(__file__).parents[2]
MODULES = sorted(SOURCE.rglob("*.py"))

MAX_PACKAGES = 17

CHECKED_TEXTS = (
    ("src/scbm", "*.py"),
    ("src/scbm", "*.md"),
    ("docs", "*.md"),
    ("docs", "*.py"),
    ("tests", "*.py"),
    ("benchmarks", "*.py"),
    ("study", "*.py"),
    ("study", "*.md"),
    ("examples", "*.py"),
    ("examples", "*.md"),
    ("examples", "*.yaml"),
)
"""Folders, and the files in them whose words are checked. Models of the study have the words of their cells."""

CLOCK_READERS = (
    "nodes",
    "cli",
    "store/store_writer.py",
    "closing/current_date.py",
    "running/search_guard.py",
    "testing/batches",
    "web/console_runs.py",
)
"""Packages and modules that may read a clock; CONTRIBUTING.md lists them, too."""

CLOCK_MODULES = frozenset({"time", "sched", "timeit"})
CLOCK_CLASSES = frozenset({"datetime", "date"})
CLOCK_METHODS = frozenset({"now", "today", "utcnow"})
"""Methods of `datetime` and `date` that read a clock; other uses of these classes only convert."""

_LIKE_CLOCKS = re.compile(
    rf"(?:import|from)\b.*\b(?:{'|'.join(sorted(CLOCK_MODULES))})\b|\.\s*(?:{'|'.join(sorted(CLOCK_METHODS))})\b"
)
"""Matches in each text of a module that reads a clock; other texts may match, too."""

HOUSE_WORDS = re.compile(
    r"\b(rooms?|strangers?|desks?|bench|ledgers?|seats?|whoever|nobody|somebody|for ever|told of|"
    r"what is looked at|comes? to the head)\b",
    re.IGNORECASE,
)
"""Metaphors and riddles of an earlier version of the texts; CONTRIBUTING.md says what to write."""

HOUSE_NAMES = frozenset({"tell", "tells", "told", "said", "stranger", "strangers", "telling"})
"""Words of names in code: write `report`, `message`, `output`, `diagnostic`, or what the value is."""

_NAMES = "|".join(sorted(HOUSE_NAMES))
_LIKE_HOUSE_NAMES = re.compile(rf"(?:(?<![a-z])(?:{_NAMES})|{_NAMES.title()})(?![a-z])|{_NAMES.upper()}")
"""Matches in each text that has such a name; comments may match, too."""

WITH_HOUSE_WORDS = Path(__file__).with_name("with_house_words.txt")
"""Files that still have some, a line each; a file that has none any more has to leave the list."""

MAX_PROSE_LITERALS = 1
"""Maximum number of sentences inside the assertions of a test file; golden files have wording."""

WITH_PROSE_LITERALS = Path(__file__).with_name("with_prose_literals.txt")
"""Test files with more of them, a line each with its number; the numbers may only shrink."""


def packages() -> list[str]:
    return sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))


def reads_clock(path: Path) -> bool:
    """Return whether a module imports one of time, or calls a method that returns the present moment or date."""
    text = path.read_text(encoding="utf-8")
    if not _LIKE_CLOCKS.search(text):
        return False  # without parsing the module
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Import(names=names):
                imported = [alias.name for alias in names]
            case ast.ImportFrom(module=str(module), level=0):
                imported = [module]
            case ast.Attribute(value=ast.Name(name) | ast.Attribute(attr=name), attr=method) if name in CLOCK_CLASSES:
                imported = ["time"] if method in CLOCK_METHODS else []
            case _:
                continue
        if CLOCK_MODULES & set(imported):
            return True
    return False


def texts() -> dict[str, Path]:
    """Return the files whose words are checked, by their path from the root."""
    folders = [(ROOT / folder, pattern) for folder, pattern in CHECKED_TEXTS]
    found = [path for folder, pattern in folders for path in sorted(folder.rglob(pattern)) if path != Path(__file__)]
    found += [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
    found += [path for path in sorted((ROOT / ".ci").iterdir()) if path.is_file()]
    return {path.relative_to(ROOT).as_posix(): path for path in found}


def house_words(path: Path) -> list[str]:
    """Return the lines with house words, and where they are."""
    text = path.read_text(encoding="utf-8")
    if not HOUSE_WORDS.search(text):
        return []
    found = ((number, HOUSE_WORDS.search(line)) for number, line in enumerate(text.splitlines(), 1))
    return [f"{number}: {match[0]}" for number, match in found if match]


def names_in_code(path: Path) -> list[str]:
    """Return the names of a module that have a house word in them, and where they are."""
    if not _LIKE_HOUSE_NAMES.search(path.read_text(encoding="utf-8")):
        return []  # tokens take far longer
    with path.open("rb") as file:
        names = [token for token in tokenize(file.readline) if token.type == NAME]
    return [f"{name.start[0]}: {name.string}" for name in names if HOUSE_NAMES & set(_words(name.string))]


def _words(name: str) -> list[str]:
    """Return the words of a name in snake case or camel case, in lower case."""
    return [word.lower() for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+", name)]


def test_there_are_few_packages() -> None:
    assert len(packages()) <= MAX_PACKAGES, packages()


def test_no_folder_has_many_modules() -> None:
    assert full_folders(source_texts()) == {}


def test_a_module_name_is_used_once() -> None:
    assert repeated_modules(source_texts()) == []


def test_a_class_name_is_used_once() -> None:
    assert repeated_classes(source_texts()) == []


@pytest.mark.parametrize(
    ("texts", "circles"),
    [
        ({"a.py": "import scbm.b", "b.py": "from scbm.c import C", "c.py": "C = 1"}, []),
        ({"a.py": "import scbm.b", "b.py": "from scbm.c import C", "c.py": "def f():\n    import scbm.a"}, [3]),
        ({"a.py": "from scbm import b", "b.py": "if TYPE_CHECKING:\n    from scbm.a import A"}, [2]),
        ({"p/__init__.py": "from scbm.p.a import A", "p/a.py": "from scbm.p.b import B", "p/b.py": ""}, []),
        ({"p/__init__.py": "from scbm.p.a import A", "p/a.py": "from scbm.p import A"}, [2]),
    ],
)
def test_a_circle_is_a_group_of_files_that_import_each_other(texts: dict[str, str], circles: list[int]) -> None:
    assert [len(circle) for circle in circles_of_files(texts)] == circles


def test_lines_of_code_are_those_of_statements() -> None:
    text = '"""A module."""\n\nimport os\n\n# a comment\nA = (\n    1\n)\n"""One."""\n\n\n'
    text += 'def f():\n    """Two."""\n    return "x"\n'
    assert lines_of_code(text) == 5


def test_no_files_import_each_other() -> None:
    assert circles_of_files(source_texts()) == []


def test_few_modules_read_a_clock() -> None:
    readers = [path.relative_to(SOURCE).as_posix() for path in MODULES if reads_clock(path)]
    may_read = {reader: [name for name in CLOCK_READERS if f"{reader}/".startswith(f"{name}/")] for reader in readers}
    assert [reader for reader, allowed in may_read.items() if not allowed] == []
    assert {name for allowed in may_read.values() for name in allowed} == set(CLOCK_READERS), "these read none any more"


def test_the_rules_name_the_modules_that_read_a_clock() -> None:
    rules = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.search(r"Only ([^.]*(?:\.py[^.]*)*) read a clock", rules)
    assert named is not None
    assert re.findall(r"`([^`]*)`", named[1]) == list(CLOCK_READERS)


def test_texts_have_no_house_words(request: pytest.FixtureRequest) -> None:
    found = [name for name, path in texts().items() if house_words(path)]
    if request.config.getoption("--update-golden"):
        WITH_HOUSE_WORDS.write_text("".join(f"{name}\n" for name in found), encoding="utf-8")
    known = WITH_HOUSE_WORDS.read_text(encoding="utf-8").splitlines()
    new = {name: house_words(texts()[name]) for name in found if name not in known}
    assert new == {}
    assert [name for name in known if name not in found] == [], "these leave the list"


@pytest.mark.parametrize(
    ("text", "is_sentence"),
    [
        ("there is no variable `lef`", True),
        ("m.yaml:3:1: error[wrong-shape]: this key is a list", True),
        ("m.yaml:3:1: error[wrong-shape]", False),
        ("door == open && lamp == dark", False),
        ("case: first\nmodel: cell.yaml\ngoal: scanned\n", False),
        ("scbm close cell.yaml --out closed", False),
        ("the median is", False),
    ],
)
def test_sentences_differ_from_data(text: str, *, is_sentence: bool) -> None:
    assert is_prose(text) == is_sentence


def test_assertions_have_few_sentences(request: pytest.FixtureRequest) -> None:
    """A number in the list that is too large has to shrink; `--update-golden` never raises one."""
    paths = {path.relative_to(ROOT).as_posix(): path for path in sorted((ROOT / "tests").rglob("test_*.py"))}
    found = {name: list(prose_literals(path.read_text(encoding="utf-8"))) for name, path in paths.items()}
    many = {name: texts for name, texts in found.items() if len(texts) > MAX_PROSE_LITERALS}
    lines = (line.split() for line in WITH_PROSE_LITERALS.read_text(encoding="utf-8").splitlines())
    known = {name: int(number) for name, number in lines}
    if request.config.getoption("--update-golden"):
        known = {name: min(number, len(many[name])) for name, number in known.items() if name in many}
        WITH_PROSE_LITERALS.write_text(
            "".join(f"{name} {number}\n" for name, number in known.items()), encoding="utf-8"
        )
    assert {name: texts for name, texts in many.items() if len(texts) > known.get(name, 0)} == {}
    assert [name for name, number in known.items() if len(many.get(name, ())) < number] == [], "these numbers shrink"


def test_names_in_code_have_no_house_words() -> None:
    modules = {name: path for name, path in texts().items() if path.suffix == ".py"}
    assert {name: found for name, path in modules.items() if (found := names_in_code(path))} == {}


MODULE_TEXTS = {
    "src/scbm/model/__init__.py": "from scbm.model.slugs import Slug",
    "src/scbm/model/slugs.py": "class Slug:\n    def words(self): ...",
}


@pytest.mark.parametrize(
    ("name", "exists"),
    [
        ("model/slugs.py", True),
        ("slugs.py", True),
        ("errors/slugs.py", False),
        ("model/slug", False),
        ("model/slugs", True),
        ("model.slugs.Slug", True),
        ("scbm.model.Slug", True),
        ("scbm.model.Slogan", False),
        ("slugs.Slug", True),
        ("slugs.sentence", False),
        ("Slug.words", True),
        ("Slug.sentences", False),
        ("model.yaml", True),
        ("scan/failed", True),
        ("pre.g", True),
    ],
)
def test_a_name_in_backticks_is_judged_if_it_stands_for_code(name: str, *, exists: bool) -> None:
    names = QuotedNames(MODULE_TEXTS)
    assert list(names.stale(f"A list.\nSee `{name}`.")) == ([] if exists else [f"2: {name}"])


def test_names_in_backticks_exist() -> None:
    """Pages have samples of code, in which `run.until` is no module, so only their paths are judged."""
    read = {name: path.read_text(encoding="utf-8") for name, path in texts().items() if name != "CHANGELOG.md"}
    names = QuotedNames({name: text for name, text in read.items() if name.endswith(".py")})
    found = [f"{name}:{stale}" for name, text in read.items() for stale in names.stale(text)]
    assert [stale for stale in found if "/" in stale.rpartition(": ")[2] or ".py:" in stale] == []


def test_no_package_exports_a_name_of_one_of_its_modules() -> None:
    """Importing the module would replace the exported object, in whichever order the two are imported."""
    clashes = []
    for init in sorted(SOURCE.glob("*/**/__init__.py")):
        exported = re.findall(r'^    "(\w+)",$', init.read_text(encoding="utf-8"), re.MULTILINE)
        modules = {path.stem for path in init.parent.iterdir() if path.suffix == ".py" or path.is_dir()}
        clashes += [f"{init.parent.name}.{name}" for name in exported if name in modules]
    assert clashes == []


JSON_READER = SOURCE / "model" / "json_reader.py"


def other_json_readers(path: Path) -> list[str]:
    """Return the uses of readers of the module `json` in a module, each with its line."""
    readers = ("load", "loads", "JSONDecoder")
    found: list[str] = []
    text = path.read_text(encoding="utf-8")
    if not ("json" in text and any(reader in text for reader in readers)):
        return found  # without parsing the module
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "json":
            found += [f"{node.lineno}: json.{node.attr}"] if node.attr in readers else []
        if isinstance(node, ast.ImportFrom) and node.module in ("json", "json.decoder"):
            found += [f"{node.lineno}: {each.name}" for each in node.names if each.name in readers]
    return found


def test_json_is_read_by_one_module() -> None:
    """It refuses repeated keys, `NaN`, half of a surrogate pair and deep nesting, which the module `json` lets pass."""
    assert other_json_readers(JSON_READER)
    others = [path for path in MODULES if path != JSON_READER]
    assert {path.relative_to(SOURCE).as_posix(): found for path in others if (found := other_json_readers(path))} == {}
