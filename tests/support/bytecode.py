"""Stores the bytecode of what the tests import, also where PYTHONDONTWRITEBYTECODE is set, as in many containers.

The tests start some fifty processes. Each would compile the product again, and each worker of pytest-xdist all tests.
`python -B -m pytest` stores nothing.
"""

from __future__ import annotations

import os
import sys

if "-B" not in sys.orig_argv:
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # processes that are started inherit it
    sys.dont_write_bytecode = False
