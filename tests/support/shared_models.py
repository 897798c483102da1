"""Models that tests of one process share: each text is read once, and each model is written once.

Reading and writing are functions of their arguments, and models are immutable. A text with errors is read each time.
"""

from __future__ import annotations

import pickle
from functools import lru_cache
from typing import Any

from scbm.files.codec import model_files
from scbm.files.yaml import yaml_writer

_MODELS = 200
"""Maximum number of models, and of their texts, that a process keeps: more than the tests of one package use."""

_TEXTS: dict[tuple[bytes, bool], str] = {}
"""The texts of models that were written, by their pickled data: unlike a comparison, it tells 1 from true."""

_read = lru_cache(_MODELS)(model_files._read)


def share_models() -> None:
    """Let `load_model`, `read_model`, `write_model` and `digest_of` of this process reuse their results."""
    vars(model_files).update(_read=_read, dump=_dump)


def clear_models() -> None:
    """Let this process read and write all models again, as after a change of what a model file may contain."""
    _read.cache_clear()
    _TEXTS.clear()


def _dump(data: dict[str, Any], *, short_in_flow: bool = False) -> str:
    key = pickle.dumps(data), short_in_flow
    if key not in _TEXTS:
        if len(_TEXTS) == _MODELS:
            _TEXTS.clear()
        _TEXTS[key] = yaml_writer.dump(data, short_in_flow=short_in_flow)
    return _TEXTS[key]
