"""A folder is watched: what is saved in it is noticed, what editors keep beside it is not."""

from __future__ import annotations

from pathlib import Path
from threading import Event, active_count

import pytest

from kb.watching import FolderWatch

SOON_S = 5.0


def test_a_saved_file_is_noticed(tmp_path: Path) -> None:
    """In the folder, and in folders within it; in place, or as editors do, by replacing it."""
    inner = tmp_path / "sites"
    inner.mkdir()
    threads, changed = active_count(), Event()
    watch = FolderWatch(tmp_path, changed.set)
    try:
        (inner / "lab.owl").write_text("one", encoding="utf-8")
        assert changed.wait(SOON_S)
        changed.clear()
        (inner / "lab.owl.tmp").write_text("two", encoding="utf-8")
        (inner / "lab.owl.tmp").replace(inner / "lab.owl")
        assert changed.wait(SOON_S)
    finally:
        watch.close()
    assert active_count() == threads


def test_what_editors_keep_is_not(tmp_path: Path) -> None:
    """The first that is told is the file itself, though others were saved before."""
    found: list[list[str]] = []
    changed = Event()

    def look() -> None:
        found.append(sorted(p.name for p in tmp_path.iterdir()))
        changed.set()

    watch = FolderWatch(tmp_path, look)
    try:
        for name in (".lab.owl.swp", "lab.owl~", "#lab.owl#"):
            (tmp_path / name).write_text("", encoding="utf-8")
        assert not changed.wait(1.0)
        (tmp_path / "lab.owl").write_text("", encoding="utf-8")
        assert changed.wait(SOON_S)
    finally:
        watch.close()
    assert ["lab.owl" in names for names in found] == [True]


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    """It is named."""
    with pytest.raises(FileNotFoundError, match="nowhere"):
        FolderWatch(tmp_path / "nowhere", Event().set)
