"""The planner and its peers, each a program of its own that solves one instance and tells what it finds."""
