"""Kill matrices as files: JSON, compressed with gzip, with sets of whole numbers as hexadecimal texts."""

from __future__ import annotations

import gzip
from typing import TYPE_CHECKING, TypeAlias

import msgspec
from kill_matrix import CaseFacts, KillMatrix, MutantRow

if TYPE_CHECKING:
    from pathlib import Path

_Number: TypeAlias = "int | str"
"""A whole number; as a text in base 16 if it has more bits than each reader of JSON keeps."""

_BITS = 53


class _CaseInFile(msgspec.Struct, array_like=True):
    requests: int
    visited: _Number
    completed: _Number
    event_pairs: _Number
    state_pairs: _Number


class _MutantInFile(msgspec.Struct, array_like=True):
    name: str
    operator: str
    found: list[_Number]


class _MatrixInFile(msgspec.Struct):
    name: str
    group: str
    digest: str
    obligations: list[str]
    operations: int
    cases: list[_CaseInFile]
    closed: list[_CaseInFile]
    mutants: list[_MutantInFile]
    equivalent: int
    all_mutants: int
    cpu_s: float
    left: str


def path_of(name: str, directory: Path) -> Path:
    """Return the file for the kill matrix of a model."""
    return directory / f"{name}.json.gz"


def write_matrix(matrix: KillMatrix, path: Path) -> None:
    """Write a kill matrix; equal ones have the same bytes, with the same version of zlib."""
    data = _MatrixInFile(
        name=matrix.name,
        group=matrix.group,
        digest=matrix.digest,
        obligations=list(matrix.obligations),
        operations=matrix.operations,
        cases=[_case_in_file(case) for case in matrix.cases],
        closed=[_case_in_file(case) for case in matrix.closed],
        mutants=[_MutantInFile(row.name, row.operator, [*map(_text, row.found)]) for row in matrix.mutants],
        equivalent=matrix.equivalent,
        all_mutants=matrix.all_mutants,
        cpu_s=matrix.cpu_s,
        left=matrix.left,
    )
    text = msgspec.json.format(msgspec.json.encode(data), indent=0)
    path.write_bytes(gzip.compress(text + b"\n", compresslevel=9, mtime=0))


def read_matrix(path: Path) -> KillMatrix:
    """Return the kill matrix that an earlier run wrote."""
    data = msgspec.json.decode(gzip.decompress(path.read_bytes()), type=_MatrixInFile)
    return KillMatrix(
        data.name,
        data.group,
        data.digest,
        tuple(data.obligations),
        data.operations,
        tuple(map(_case_of, data.cases)),
        tuple(map(_case_of, data.closed)),
        tuple(MutantRow(row.name, row.operator, tuple(map(_number, row.found))) for row in data.mutants),
        data.equivalent,
        data.all_mutants,
        data.cpu_s,
        data.left,
    )


def _case_in_file(case: CaseFacts) -> _CaseInFile:
    sets = (case.visited, case.completed, case.event_pairs, case.state_pairs)
    return _CaseInFile(case.requests, *map(_text, sets))


def _case_of(case: _CaseInFile) -> CaseFacts:
    sets = (case.visited, case.completed, case.event_pairs, case.state_pairs)
    return CaseFacts(case.requests, *map(_number, sets))


def _text(number: int) -> _Number:
    return hex(number) if number.bit_length() > _BITS else number


def _number(value: _Number) -> int:
    return value if isinstance(value, int) else int(value, 16)
