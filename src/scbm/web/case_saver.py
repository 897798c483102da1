"""Saves the cases of a console, and replaces no file that the page has not saved itself."""

from __future__ import annotations

import os
from hashlib import sha256
from pathlib import Path
from typing import Any

from scbm.files.codec.value_reader import CASE_NAME
from scbm.files.file_writer import replace_file
from scbm.web.case_edits import EditError


class CaseSaver:
    """Writes cases into one folder.

    Attributes:
        model_path: the path of the model from that folder, as cases in it name the model.
    """

    def __init__(self, folder: Path, model: Path) -> None:
        self._folder = folder
        self.model_path = Path(os.path.relpath(model.resolve(), folder.resolve())).as_posix()

    def refuse(self, name: str, known: str) -> None:
        """Raise `EditError` for a name that no file here may have, and for a file that is not as the page saved it.

        Args:
            name: the name of the case.
            known: the digest of the file that the page has saved under this name; empty if it has saved none.
        """
        if not CASE_NAME.fullmatch(name):
            raise EditError(
                f"`{name}` is no name of a case: letters, digits, `_`, `-`, `.`; it begins with a letter or `_`"
            )
        path = self._path(name)
        if os.path.lexists(path) and (path.is_symlink() or not path.is_file() or _digest(path.read_bytes()) != known):
            raise EditError(
                f"{path} is there already, and this page has not saved it as it is now; choose another name"
            )

    def save(self, name: str, known: str, text: str) -> dict[str, Any]:
        """Write a case, and return its path and its digest. Raise `EditError` if it cannot be written, or as above."""
        self.refuse(name, known)
        path, content = self._path(name), text.encode()
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            replace_file(path, content)
        except OSError as error:
            raise EditError(f"cannot write {path}: {(error.strerror or str(error)).lower()}") from None
        return {"path": str(path), "known": _digest(content)}

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.yaml"


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
