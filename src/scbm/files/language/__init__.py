"""The language of predicates, actions and requirements: text to syntax tree to resolved expression."""
