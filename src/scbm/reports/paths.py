"""Paths as tools on other machines read them."""

from __future__ import annotations

import posixpath
import re

_DRIVE = re.compile(r"[A-Za-z]:/")


def portable(path: str) -> str:
    """A path with forward slashes and without detours: `./cells/../cell.yaml` is `cell.yaml`."""
    return posixpath.normpath(path.replace("\\", "/"))


def is_absolute(path: str) -> bool:
    """Whether a portable path begins at the root of a file system, or with the letter of a drive."""
    return path.startswith("/") or _DRIVE.match(path) is not None
