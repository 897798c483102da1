"""Explains the errors of the YAML parser to people who write models and cases."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.reader import ReaderError

from scbm.model import Diagnostic, Place, Slug

if TYPE_CHECKING:
    from scbm.files.yaml.source_text import SourceText


class _Fault(Struct, frozen=True):
    """An error of the YAML parser.

    Attributes:
        source: the text.
        problem: what the parser found, in its words.
        index: where the parser found it.
        context: what the parser was reading, in its words.
        begin: where that begins.
    """

    source: SourceText
    problem: str
    index: int
    context: str
    begin: int

    @property
    def character(self) -> str:
        """The character where the error was found; empty at the end of the text."""
        return self.source.text[self.index : self.index + 1]

    @property
    def opener(self) -> str:
        """The first character of the construct that the parser was reading."""
        return self.source.text[self.begin : self.begin + 1]

    @property
    def place(self) -> Place:
        """The place where the error was found."""
        return self.source.place(self.index)

    @property
    def before(self) -> str:
        """The text before the error in its line."""
        return self.source.lines[self.place.line - 1][: self.place.column - 1]

    @property
    def indentation(self) -> int:
        """The indentation of the line where the error was found."""
        return _indentation(self.source.lines[self.place.line - 1])

    @property
    def opener_indentation(self) -> int:
        """The indentation of the line where the construct begins."""
        return _indentation(self.source.lines[self.source.place(self.begin).line - 1])

    def diagnostic(self, message: str, index: int, remedy: str | None, slug: Slug = Slug.YAML_SYNTAX) -> Diagnostic:
        """Return the error as a diagnostic."""
        place = self.source.place(index)
        return Diagnostic(slug, message, place, remedy, self.source.lines[place.line - 1])


def yaml_fault(error: Exception, source: SourceText) -> Diagnostic:
    """Return the diagnostic for an error of the YAML parser, with a remedy."""
    if isinstance(error, ReaderError):
        character = source.text[error.position]
        fault = _Fault(source, "", error.position, "", 0)
        message = f"the character U+{ord(character):04X} cannot stand in a YAML file"
        return fault.diagnostic(message, error.position, "leave it out")
    if not isinstance(error, MarkedYAMLError):
        words = str(error).splitlines()[0] if str(error) else type(error).__name__
        return Diagnostic(Slug.YAML_SYNTAX, f"this is not YAML: {words}", Place(source.file, 1))
    mark = error.problem_mark or error.context_mark
    context_mark = error.context_mark or mark
    index = min(mark.index, len(source.text)) if mark is not None else 0
    begin = context_mark.index if context_mark is not None else 0
    return _explain(_Fault(source, error.problem or "", index, error.context or "", begin))


def _indentation(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _explain(fault: _Fault) -> Diagnostic:
    for pattern, explanation in _EXPLANATIONS:
        if re.search(pattern, f"{fault.context}; {fault.problem}"):
            return explanation(fault)
    words = " ".join(part for part in (fault.context, fault.problem) if part)
    return fault.diagnostic(f"this is not YAML: {words}", fault.index, None)


def _tag(fault: _Fault) -> Diagnostic:
    message = "a value that begins with `!` is read as a YAML tag"
    return fault.diagnostic(message, fault.begin, "put the value into quotes", Slug.YAML_TAG)


def _bad_beginning(fault: _Fault) -> Diagnostic:
    if fault.character == "\t":
        return fault.diagnostic("a tab cannot stand here", fault.index, "indent and separate with spaces")
    character = "a backtick" if fault.character == "`" else f"`{fault.character}`"
    message = f"a value cannot begin with {character}"
    return fault.diagnostic(message, fault.index, "put the value into quotes")


def _anchor(fault: _Fault) -> Diagnostic:
    message = f"a value that begins with `{fault.opener}` is read as a YAML anchor or alias"
    return fault.diagnostic(message, fault.begin, "put the value into quotes")


def _directive(fault: _Fault) -> Diagnostic:
    message = "a line that begins with `%` is read as a YAML directive"
    begin = fault.source.text.rfind("%", 0, fault.index + 1)
    return fault.diagnostic(message, max(begin, 0), "leave it out, or put the value into quotes")


def _colon(fault: _Fault) -> Diagnostic:
    line = fault.source.lines[fault.place.line - 1]
    typed = _ROUND.match(line)
    if typed is not None:
        parameters = re.sub(r"\s*:\s*", " in ", typed[2])
        index = fault.index - len(fault.before) + typed.start(2) - 1
        message = f"`{typed[1]}` has round brackets, and parameters stand in square brackets"
        return fault.diagnostic(message, index, f"write `{typed[1]}[{parameters}]`")
    if ":" in fault.before:
        remedy = "write `in` for `:`" if _TYPED.search(fault.before) else "put the value into quotes"
        return fault.diagnostic("`:` cannot stand inside a value", fault.index, remedy)
    begin = fault.index - len(fault.before.lstrip())
    remedy = "indent it like the keys beside it, and check the line before for a missing `:`"
    return fault.diagnostic("a key cannot stand here", begin, remedy)


def _no_colon(fault: _Fault) -> Diagnostic:
    remedy = "write `key: value`, or indent the line if it belongs to the value before"
    remedy = _comment_remedy(fault, fault.begin) or remedy
    return fault.diagnostic("a `:` is missing in this line", fault.begin, remedy)


def _misplaced_line(fault: _Fault) -> Diagnostic:
    if fault.before.strip(" -?"):
        message = "nothing can follow here after the value before"
        return fault.diagnostic(message, fault.index, "put the whole value into one pair of quotes")
    what = "list" if "sequence" in fault.context or "collection" in fault.context else "mapping"
    line = fault.source.place(fault.begin).line
    message = f"this line is no part of the {what} that begins in line {line}"
    remedy = _comment_remedy(fault, fault.index) or "check the indentation of both, and of the lines between"
    return fault.diagnostic(message, fault.index, remedy)


def _comment_remedy(fault: _Fault, index: int) -> str | None:
    """Return the remedy if a comment at the end of the line before cuts off a value that continues here."""
    number = fault.source.place(index).line - 1
    before, line = fault.source.lines[max(0, number - 1)], fault.source.lines[number]
    if " #" not in before or _indentation(line) <= _indentation(before):
        return None
    return "a comment ends the value of the line before: move it, or put the value into quotes"


def _second_root(fault: _Fault) -> Diagnostic:
    if fault.source.text.startswith("%"):
        return _directive(fault)
    if fault.before.strip():
        return _misplaced_line(fault)
    remedy = "indent all keys of the file alike, from the first one on"
    return fault.diagnostic("this line does not continue the text before", fault.index, remedy)


def _unclosed_bracket(fault: _Fault) -> Diagnostic:
    tag = _TAG.search(fault.source.text, fault.begin, fault.index)
    if tag is not None:
        return _tag(replace(fault, begin=tag.start(1)))
    closer = "]" if "']'" in fault.problem else "}"
    opened = fault.source.place(fault.begin)
    if not fault.character or (fault.place.line > opened.line and fault.indentation <= fault.opener_indentation):
        return fault.diagnostic(f"this `{fault.opener}` is not closed", fault.begin, f"a `{closer}` is missing")
    remedy = f"a `{closer}` is missing for the `{fault.opener}` in line {opened.line}, or a value needs quotes"
    if fault.character in "{[":
        remedy = "a `,` or a `:` is missing before it, or the value needs quotes"
    index = _INDEX.match(fault.source.text, len(fault.source.text[: fault.index].rstrip(_WORD_CHARACTERS)))
    if fault.character == "[" and index is not None:
        words = (_object_for(part.strip(), fault.source.text) for part in index[2].split(","))
        dotted = ".".join((index[1], *words))
        instead = f"`{dotted}`, or put the value into quotes"
        if fault.source.text[index.end() :].lstrip(" ").startswith(":"):  # a key declares a name with its parameters
            instead = f'`"{index[0]}"`, with quotes'
        remedy = f"write {instead}: `[` begins a list here"
    return fault.diagnostic(f"expected `,` or `{closer}`", fault.index, remedy)


def _object_for(word: str, text: str) -> str:
    """Return the first object of a type, and any other word itself: an index in an expression is no type."""
    begin = re.search(r"(?m)^types:", text)
    declared = re.compile(rf"(?<![\w.]){re.escape(word)}:\s*(?:\{{\s*objects:\s*)?\[\s*(\w+)")
    match = declared.search(text, begin.end()) if begin is not None else None
    return word if match is None else match[1]


_WORD_CHARACTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_."
_INDEX = re.compile(r"([A-Za-z_][\w.]*)\[([\w ,]+)\]", re.ASCII)
"""A name with an index."""

_TYPED = re.compile(r"^\s*[\w.\"']+\[\s*\w+\s*:|\b(forall|exists|count)\s+\w+\s*$")
"""A parameter with its type behind a colon."""

_ROUND = re.compile(r"\s*([\w.]+)\((\s*\w+\s*:\s*\w+(?:\s*,\s*\w+\s*:\s*\w+)*)\s*\)\s*:", re.ASCII)
"""A key whose parameters stand in round brackets, each with its type behind a colon."""

_TAG = re.compile(r"[\[{,:]\s*(!)")
"""A value in brackets that begins with `!`. YAML takes the next comma or bracket for a part of the tag."""


def _no_value(fault: _Fault) -> Diagnostic:
    if not fault.character.strip():
        return fault.diagnostic("a value is missing", fault.index, None)
    message = f"`{fault.character}` cannot stand here"
    remedy = "leave it out, or put the value into quotes"
    return fault.diagnostic(message, fault.index, remedy)


def _unclosed_quote(fault: _Fault) -> Diagnostic:
    return fault.diagnostic(f"this `{fault.opener}` is not closed", fault.begin, f"a `{fault.opener}` is missing")


def _no_escape(fault: _Fault) -> Diagnostic:
    message = "`\\` begins an escape inside double quotes, and this is none"
    return fault.diagnostic(message, fault.index - 1, "write `\\\\`, or use single quotes")


def _no_place_for_list(fault: _Fault) -> Diagnostic:
    remedy = "begin the list in a line of its own, or put the value into quotes"
    return fault.diagnostic("`- ` cannot stand here", fault.index, remedy)


def _no_place_for_key(fault: _Fault) -> Diagnostic:
    return fault.diagnostic("`? ` cannot stand here", fault.index, "put the value into quotes")


def _text_beside_bar(fault: _Fault) -> Diagnostic:
    message = f"after `{fault.opener}` the text begins in the next line"
    remedy = "write it into the lines below, or put the value into quotes"
    return fault.diagnostic(message, fault.begin, remedy)


def _uneven_text(fault: _Fault) -> Diagnostic:
    message = "a line before this one has more spaces than this one is indented by"
    return fault.diagnostic(message, fault.index, "leave out the spaces in the empty lines before")


_EXPLANATIONS = (
    (r"(scanning|parsing) a tag|undefined tag handle", _tag),
    (r"that cannot start any token", _bad_beginning),
    (r"scanning an (anchor|alias)", _anchor),
    (r"directive|incompatible YAML document", _directive),
    (r"mapping values are not allowed|found unexpected ':'", _colon),
    (r"could not find expected ':'", _no_colon),
    (r"expected <block end>", _misplaced_line),
    (r"expected '<document start>'|non-comment content after document end", _second_root),
    (r"expected ',' or", _unclosed_bracket),
    (r"expected the node content", _no_value),
    (r"quoted scalar; found unexpected", _unclosed_quote),
    (r"escape", _no_escape),
    (r"sequence entries are not allowed", _no_place_for_list),
    (r"mapping keys are not allowed", _no_place_for_key),
    (r"more indented follow up line", _uneven_text),
    (r"scanning a block scalar", _text_beside_bar),
)
"""Explanations by the words of the parser; the first that matches applies."""
