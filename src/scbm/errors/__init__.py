"""What can go wrong, said once: a slug, a place, a remedy.

Knows nothing of models, files or terminals. Every other room may import it.
"""

from scbm.errors.diagnostics import Diagnostic, Place, Severity
from scbm.errors.exceptions import InputError, ScbmError
from scbm.errors.slugs import Slug

__all__ = ["Diagnostic", "InputError", "Place", "ScbmError", "Severity", "Slug"]
