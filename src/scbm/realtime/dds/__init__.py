"""Cyclone DDS, at home in ROS 2: the one package that imports cyclonedds."""
