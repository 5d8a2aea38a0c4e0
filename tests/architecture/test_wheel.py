"""The wheel holds everything and works outside the checkout."""

import os
import site
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("kb", "planner", "grounding", "executive", "sim")


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that has to succeed, with nothing of this checkout in its environment; its output."""
    environment = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "PYTHONHOME"}}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", ROOT, "--no-deps", "--no-build-isolation", "--wheel-dir", folder, cwd=folder)
    (file,) = folder.glob("concertmaster-*.whl")
    return file


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The `bin` folder of an environment that holds the wheel, and sees the third-party packages of this one."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder, with_pip=False, symlinks=True)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", folder / "bin" / "python")
    run(*pip, "install", "--no-deps", "--no-index", wheel, cwd=folder)
    # A folder named in a .pth file is put on the path; .pth files in it, such as the one of a checkout, do not count.
    (packages,) = folder.glob("lib/python*/site-packages")
    (packages / "third_party.pth").write_text("\n".join(site.getsitepackages()), encoding="utf-8")
    return folder / "bin"


def test_the_wheel_holds_every_file_of_the_packages(wheel: Path) -> None:
    """Rules, ontologies, shapes, models, worlds and py.typed travel with the code, and nothing else does."""
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if ".dist-info/" not in name}
    files = {
        file.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert packed == files
    assert {f"{package}/py.typed" for package in PACKAGES} <= packed


def test_the_demo_runs_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    """The installed command plays FindEmptyDrink from installed files alone, and leaves trace and pictures."""
    where = run(installed / "python", "-c", "import executive.cli; print(executive.cli.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(installed.parent)
    said = run(installed / "concertmaster", "run", "FindEmptyDrink", "room=tue_lab", "--robots", "2", cwd=tmp_path)
    assert "FindEmptyDrink-1 completed" in said
    made = {file.name for file in (tmp_path / "runs" / "FindEmptyDrink-1").iterdir()}
    assert made == {"trace.jsonl", "metrics.json", "gantt.png", "top_view.png"}
