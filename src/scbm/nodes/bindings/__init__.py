"""Bindings of resources to drivers of ROS 2: the keys that `nodes` registers with files, and what they mean."""
