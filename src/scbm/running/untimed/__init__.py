"""What can follow from a situation of a run, without time: closing explores these steps, testing looks ahead in them.

The runner walks the same micro-steps in time.
"""
