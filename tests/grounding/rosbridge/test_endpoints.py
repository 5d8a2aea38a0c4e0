"""Where robots are."""

from __future__ import annotations

from pathlib import Path

import pytest

from grounding.rosbridge.connection import Endpoint
from grounding.rosbridge.endpoints import ROS_2, BadEndpoints, Reached, reached

ROBOTS = ("pico_1", "amigo_1")


def written(tmp_path: Path, text: str) -> Path:
    """A file of this text."""
    file = tmp_path / "robots.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_one_address_may_be_that_of_all() -> None:
    """Of whatever robots there are."""
    here = Reached(endpoint=Endpoint(uri="wss://fleet.example.org/bridge"))
    assert reached("wss://fleet.example.org/bridge", ROBOTS, {}) == {"amigo_1": here, "pico_1": here}
    ros_2 = Reached(endpoint=Endpoint(uri=ROS_2))
    assert reached(ROS_2, ROBOTS, {}) == {"amigo_1": ros_2, "pico_1": ros_2}


def test_a_file_tells_where_each_robot_is(tmp_path: Path) -> None:
    """Tokens come from the environment and certificates from beside the file."""
    first = '[robots.amigo_1]\nuri = "wss://a:1"\ntoken_variable = "T"\nca_file = "site.pem"\nbinary = true\n'
    file = written(tmp_path, f'{first}[robots.pico_1]\nuri = "ws://p:2"\n')
    amigo = Endpoint(uri="wss://a:1", token="secret", ca_file=tmp_path / "site.pem")
    assert reached(file, ROBOTS, {"T": "secret"}) == {
        "amigo_1": Reached(endpoint=amigo, binary=True),
        "pico_1": Reached(endpoint=Endpoint(uri="ws://p:2")),
    }
    assert reached(str(file), ROBOTS, {"T": "secret"}) == reached(file, ROBOTS, {"T": "secret"})
    assert "secret" not in repr(reached(file, ROBOTS, {"T": "secret"}))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[robots.amigo_1]\nuri = "ws://a:1"\n', "robots.pico_1: is a robot of this site; say where it is"),
        (
            "".join(f'[robots.{r}]\nuri = "ws://a:1"\n' for r in (*ROBOTS, "rex")),
            "robots.rex: is no robot of this site .its robots are amigo_1, pico_1",
        ),
        ("[robots.amigo_1]\nbinary = true\n", "robots.amigo_1.uri: missing"),
        ('[robots.amigo_1]\nuri = "ws://a:1"\nurl = "x"\n', "robots.amigo_1.url: unknown field"),
        ('[robots.amigo_1]\nuri = "ws://a:1"\ntoken_variable = "T"\n', "T is not set in the environment"),
        ("[robot]\n", "robots: missing"),
        ("robots", "is not TOML"),
    ],
)
def test_a_wrong_file_is_refused(text: str, told: str, tmp_path: Path) -> None:
    """With its name, the field, and what would be right."""
    with pytest.raises(BadEndpoints, match=told) as error:
        reached(written(tmp_path, text), ROBOTS, {})
    assert "robots.toml" in str(error.value)


def test_a_file_that_is_not_there_is_refused() -> None:
    """As other files that cannot be read."""
    with pytest.raises(BadEndpoints, match="cannot be read"):
        reached("nowhere.toml", ROBOTS, {})
