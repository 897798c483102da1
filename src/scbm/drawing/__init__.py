"""Pictures of a model: one automaton for each variable, coloured by what the tests did."""
