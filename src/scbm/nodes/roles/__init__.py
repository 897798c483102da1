"""The nodes of a cell (controller, resources, tester) and how a process runs one."""
