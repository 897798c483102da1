"""Sentences in the code of tests: literals inside assertions that look like wording of a message, not like data."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

MIN_WORDS = 4
"""Number of words from which on a literal counts as prose; shorter ones name a thing."""

_WORD = re.compile(r"(?<![\w./<>=&$\\-])(?:a|[a-z][a-z']+(?:-[a-z]+)*)(?![\w/=_<(|\\-]|\.\w)", re.IGNORECASE)
_NO_WORDS = re.compile(r"`[^`]*`|^\S+: (?:error|warning)\[[a-z-]+\]: ", re.MULTILINE)
"""What a message quotes, and the head of a diagnostic, which is no wording."""

_DATA = re.compile(
    r"[=!<>]=|&&|\|\||<-|[{}]|--?>|<\w+ |SELECT |(?:^| )-- |^(?:never|always) |^pip install |^ *[\w.]+: .*\n",
    re.MULTILINE,
)
"""Predicates, actions, YAML, XML, SQL, requirements and commands."""


def is_prose(text: str) -> bool:
    """Return whether a literal has at least `MIN_WORDS` words and nothing that marks data."""
    bare = _NO_WORDS.sub("`", text)
    return _DATA.search(bare) is None and len(_WORD.findall(bare)) >= MIN_WORDS


def prose_literals(source: str) -> Iterator[str]:
    """Yield the literals of prose inside the assertions of a module, each with its line."""
    for node in _statements(ast.parse(source)):
        if isinstance(node, ast.Assert):
            for each in ast.walk(node.test):
                if isinstance(each, ast.Constant) and isinstance(each.value, str) and is_prose(each.value):
                    yield f"{each.lineno}: {each.value}"


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements of a module, of blocks in it too, without their expressions, which are far more."""
    for field in ("body", "handlers", "orelse", "finalbody", "cases"):
        for each in getattr(node, field, ()):
            yield each
            yield from _statements(each)
