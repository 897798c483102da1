"""Pictures of a model: one automaton for each variable, colored by what the tests did."""
