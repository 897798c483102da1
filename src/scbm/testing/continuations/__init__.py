"""What can follow after runs: whether waiting runs can reach their goals, and which goals are lost (semantics 7.12)."""
