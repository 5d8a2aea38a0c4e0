"""`concertmaster simulate`: the simulated fleet of a site behind a rosbridge server, and in ROS 1."""

from __future__ import annotations

import argparse
import os

from executive.exit_codes import OK
from executive.replay import scenario_of
from executive.serving import serve_simulated
from grounding.ros1.node import Master
from grounding.rosbridge.access import read_access


def simulate(options: argparse.Namespace) -> int:
    """Serve until Ctrl-C; the exit status, should the server stop otherwise."""
    served = serve_simulated(
        options.site,
        scenario=scenario_of(options.scenario) if options.scenario else None,
        knowledge=options.knowledge,
        seed=options.seed,
        host=options.host,
        port=options.port,
        master=Master(uri=options.ros1) if options.ros1 else None,
        package=options.srv,
        access=read_access(options.access, os.environ) if options.access else None,
    )
    with served as (server, services):
        for name in services:
            print(name)
        if options.ros1:
            print(f"offering them in ROS 1 too, master {options.ros1}")
        print(f"serving at {server.uri} until Ctrl-C", flush=True)
        server.wait()
    return OK
