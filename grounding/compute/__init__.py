"""Compute services: single, generic computations behind the executive's actions ([RoboEarth] Table 2).

`maps.loc_map`, `maps.nav_map`, `localization.pose`, `path.path` (and `path.path_lengths_m`, for the planner's travel
times), `velocity.vel_cmd`, `detection.detection`.

Each service is a pure function: keyword arguments are the fields of the request, the returned dict holds the fields of
the reply. Messages are ROS messages (`grounding.messages`); units are SI and radians; `t_s` is the time of the call,
used for stamps. A service that cannot do its job raises `errors.ComputeFailed`.
"""
