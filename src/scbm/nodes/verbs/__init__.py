"""The verbs of `scbm node`: controller, resources and tester, each as a process of its own."""
