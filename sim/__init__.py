"""The simulator: robots, rooms and drinks behind the same ROS services that real robots offer.

It knows nothing of the mind: it answers service calls, and moves in lockstep with a `SimClock`. Read `fleet.py`
first (what is offered), then `robot.py` and `sensors.py` (what happens in a call), then `physics.py` (the engine).
"""
