"""Parts of the verbs that run cases: suites, stores, nodes, and runs from logs."""
