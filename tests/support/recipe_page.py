"""The samples of `docs/how-to/recipes.md` as code: the test of a recipe adds what the page shows, and nothing else."""

from __future__ import annotations
import __future__

import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from support.layout_rules import source_texts
from support.shared_models import clear_models

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/how-to/recipes.md"

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE_NAME = re.compile(r"[\w-]+\.(?:yaml|json|txt|db|html|md)")
_FILE = re.compile(r"# (?:src/(?P<module>[\w/]+)\.py|(?P<file>[\w.-]+))\n")


@dataclass(frozen=True)
class Recipe:
    """One section of the page.

    Attributes:
        modules: the Python samples, each with the name of the module that it belongs to, in the order of the page.
        files: the other samples by their file names: models, cases, certificates.
        commands: the arguments of the commands that use what was added.
    """

    modules: tuple[tuple[str, str], ...]
    files: dict[str, str]
    commands: tuple[tuple[str, ...], ...]

    def in_directory(self, command: tuple[str, ...], directory: Path) -> tuple[str, ...]:
        """Return a command with its files in a directory, but for those of the repository."""
        return tuple(
            str(directory / word) if _FILE_NAME.fullmatch(word) and not (ROOT / word).exists() else word
            for word in command
        )


def read_recipe(title: str) -> Recipe:
    """Return the samples of the section with this title."""
    sections = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    (section,) = (text for text in sections if text.startswith(f"{title}\n"))
    modules: list[tuple[str, str]] = []
    files: dict[str, str] = {}
    commands: list[tuple[str, ...]] = []
    for language, text in _BLOCK.findall(section):
        if language == "sh":
            commands += [tuple(shlex.split(line)[1:]) for line in text.splitlines() if line.startswith("scbm ")]
            continue
        head = _FILE.match(text)
        assert head is not None, f"a sample of `{title}` does not begin with the name of its file"
        if head["module"] is not None:
            modules.append((head["module"].replace("/", "."), text))
        else:
            files[head["file"]] = text
    assert modules, f"`{title}` shows no code"
    return Recipe(tuple(modules), files, tuple(commands))


def titles_with_code() -> list[str]:
    """Return the titles of the sections that show code for the package."""
    sections = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [section.partition("\n")[0] for section in sections if "\n# src/" in section]


def source_after(recipe: Recipe) -> dict[str, str]:
    """Return the text of each module, by its path from `src/scbm`, after a recipe has been followed."""
    texts = dict(source_texts())
    for name, sample in recipe.modules:
        path = f"{name.removeprefix('scbm.').replace('.', '/')}.py"
        texts[path] = texts.get(path, "") + sample
    return texts


@contextmanager
def followed(title: str, directory: Path) -> Iterator[Recipe]:
    """Follow a recipe until the block ends: add its code to its modules, and write its other files to a directory."""
    recipe = read_recipe(title)
    for name, text in recipe.files.items():
        (directory / name).write_text(text, encoding="utf-8")
    modules = {name: _module(name) for name, _ in recipe.modules}
    before = {name: dict(vars(module)) for name, module in modules.items()}
    registries = [(registry, dict(registry)) for names in before.values() for registry in _registries(names)]
    try:
        for name, text in recipe.modules:
            code = compile(text, f"docs/how-to/recipes.md: {name}", "exec", __future__.annotations.compiler_flag)
            exec(code, vars(modules[name]))  # noqa: S102 - our own page
        clear_models()
        yield recipe
    finally:
        for registry, entries in registries:
            registry.clear()
            registry.update(entries)
        for name, module in modules.items():
            vars(module).clear()
            vars(module).update(before[name])
            if not _is_file(name):
                _forget(name)
        clear_models()


def _registries(names: dict[str, Any]) -> Iterator[dict[Any, Any]]:
    """The registries among the names of a module, and those of its classes, such as the declared keys of a file."""
    for name, value in names.items():
        if name.isupper() and isinstance(value, dict):
            yield value
        elif isinstance(value, type):
            yield from (held for held in vars(value).values() if isinstance(held, dict))


def _module(name: str) -> ModuleType:
    """Return the module of a sample: an existing one, or a new and empty one."""
    if _is_file(name):
        return import_module(name)
    module = ModuleType(name)
    package, _, last = name.rpartition(".")
    setattr(import_module(package), last, module)
    sys.modules[name] = module
    return module


def _is_file(name: str) -> bool:
    return (ROOT / "src" / f"{name.replace('.', '/')}.py").is_file()


def _forget(name: str) -> None:
    package, _, last = name.rpartition(".")
    delattr(import_module(package), last)
    del sys.modules[name]
