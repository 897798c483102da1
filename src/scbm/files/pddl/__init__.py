"""Import of PDDL: a domain and a problem as the text of a lifted model (decision 54)."""

from scbm.files.pddl.pddl_import import ImportedModel, PddlImportOptions, imported_model
from scbm.files.pddl.pddl_reader import read_pddl
from scbm.files.pddl.pddl_text import PddlText

__all__ = ["ImportedModel", "PddlImportOptions", "PddlText", "imported_model", "read_pddl"]
