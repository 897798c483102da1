"""Import of PDDL: a domain and a problem as the text of a lifted model (decision 54)."""

from scbm.pddl.pddl_import import ImportedModel, PddlImportOptions, imported_model
from scbm.pddl.pddl_reader import read_pddl
from scbm.pddl.pddl_text import PddlText

__all__ = ["ImportedModel", "PddlImportOptions", "PddlText", "imported_model", "read_pddl"]
