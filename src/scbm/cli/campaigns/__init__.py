"""What the verbs that run cases share: suites, stores, nodes, runs from logs."""
