"""Types of ROS 2: their definitions, the values of their fields, their bytes and their hashes."""
