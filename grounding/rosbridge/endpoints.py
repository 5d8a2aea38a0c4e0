"""Where the robots of a site are: one address for all, or a TOML file.

[robots.amigo_1]
uri = "wss://amigo-1.example.org:9090"
token_variable = "AMIGO_TOKEN"      # of the environment; for servers that ask for one
ca_file = "site.pem"                # certificates to trust, in place of the system's; beside this file
binary = true                       # the server is ours: calls go as CBOR, which keeps infinity and is faster

[robots.pico_1]
uri = "ws://pico-1:9090"

[robots.sim_1]
uri = "ros2:"                       # in ROS 2, without a rosbridge server
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from grounding.rosbridge.connection import Endpoint
from kb.errors import BadFile
from kb.section import Section, read_file

ROS_2 = "ros2:"
"""What stands for the graph of ROS 2 in place of an address."""


class BadEndpoints(BadFile):
    """A file that says where robots are is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reached:
    """How a robot is reached.

    Attributes:
        binary: Calls go as CBOR: for our own server.
    """

    endpoint: Endpoint
    binary: bool = False


def reached(where: str | Path, robots: Iterable[str], environment: Mapping[str, str]) -> dict[str, Reached]:
    """How each robot is reached.

    Args:
        where: The address of a server that has them all (`ws://...`, `wss://...`), `ros2:`, or a file.
        environment: The variables that are set.

    Raises:
        BadEndpoints: The file is wrong, names a variable that is not set, or does not name exactly these robots.
    """
    names = sorted(robots)
    if isinstance(where, str) and where.startswith(("ws://", "wss://", ROS_2)):
        return dict.fromkeys(names, Reached(endpoint=Endpoint(uri=where)))
    file = Path(where)
    top = read_file(file, BadEndpoints)
    found = {name: _reached(section, file.parent, environment) for name, section in top.sections("robots")}
    top.end()
    for name in sorted(found.keys() ^ set(names)):
        told = "is no robot of this site" if name in found else "is a robot of this site; say where it is"
        raise BadEndpoints(str(file), f"robots.{name}", f"{told} (its robots are {', '.join(names)})")
    return found


def _reached(section: Section, folder: Path, environment: Mapping[str, str]) -> Reached:
    uri = section.text("uri")
    token = None
    if section.has("token_variable"):
        variable = section.text("token_variable")
        if variable not in environment:
            raise section.fault("token_variable", f"{variable} is not set in the environment")
        token = environment[variable]
    ca_file = folder / section.text("ca_file") if section.has("ca_file") else None
    binary = section.truth("binary") if section.has("binary") else False
    section.end()
    return Reached(endpoint=Endpoint(uri=uri, token=token, ca_file=ca_file), binary=binary)
