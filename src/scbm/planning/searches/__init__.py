"""Searches for the canonical plan: one contract, and several engines for systems of different shapes.

The engines are imported from their modules by `scbm.planning.plan_search`, because some of them load numpy.
"""

from scbm.planning.searches.search_request import PlanSearch, SearchEntry, SearchRequest

__all__ = ["PlanSearch", "SearchEntry", "SearchRequest"]
