"""A folder is watched: what is saved in it is noticed, what editors keep beside it is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue
from threading import active_count

import pytest

from kb.watching import FolderWatch

SOON_S = 5.0
LONG_S = 1.0
"""Long enough that it would have been noticed."""


def contents(folder: Path) -> dict[str, str]:
    """What the ontologies of a folder hold, by name."""
    return {p.name: p.read_text(encoding="utf-8") for p in sorted(folder.rglob("*.owl"))}


@contextmanager
def watched(folder: Path, read: Callable[[], dict[str, str]] | None = None) -> Iterator[Queue[dict[str, str]]]:
    """What a watch of a folder tells, as long as it lasts."""
    told = Queue[dict[str, str]]()
    threads = active_count()
    watch = FolderWatch(folder, read or (lambda: contents(folder)), told.put)
    try:
        yield told
    finally:
        watch.close()
    assert active_count() == threads


def test_a_saved_file_is_noticed(tmp_path: Path) -> None:
    """In a folder within; in place, as editors do by replacing it, and two at once as one change; and a deleted one."""
    inner = tmp_path / "sites"
    inner.mkdir()
    file = inner / "lab.owl"
    with watched(tmp_path) as told:
        file.write_text("one", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "one"}
        (inner / "new.owl").write_text("two", encoding="utf-8")
        (inner / "new.owl").replace(file)
        (inner / "catalog.owl").write_text("three", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"catalog.owl": "three", "lab.owl": "two"}
        file.unlink()
        assert told.get(timeout=SOON_S) == {"catalog.owl": "three"}
        assert told.empty()


def test_a_half_written_file_is_not_told_of(tmp_path: Path) -> None:
    """It is emptied and written again while all is read: what was read then counts for nothing."""
    file, reads = tmp_path / "lab.owl", list[str]()

    def read() -> dict[str, str]:
        found = contents(tmp_path)
        reads.append(found["lab.owl"])
        if found["lab.owl"] == "":
            file.write_text("whole", encoding="utf-8")
        return found

    with watched(tmp_path, read) as told:
        file.write_text("", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "whole"}
    assert reads == ["", "whole"]
    assert told.empty()


def test_files_are_read_when_nothing_changes_any_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder looks otherwise each time, then twice the same: only then it is read."""
    looks = [{"lab.owl": (1, written, 5)} for written in (0, 1, 2, 3, 3)]
    taken, reads = list[int](), list[int]()

    def look(folder: Path) -> dict[str, tuple[int, int, int]]:
        taken.append(len(taken))
        return looks[min(taken[-1], len(looks) - 1)]

    def read() -> dict[str, str]:
        reads.append(len(taken))
        return {}

    monkeypatch.setattr("kb.watching._looks", look)
    with watched(tmp_path, read) as told:
        told.get(timeout=SOON_S)
    assert reads == [5]


def test_how_it_is_now_is_told_if_wanted(tmp_path: Path) -> None:
    """Once, without any change."""
    (tmp_path / "lab.owl").write_text("one", encoding="utf-8")
    told = Queue[dict[str, str]]()
    watch = FolderWatch(tmp_path, lambda: contents(tmp_path), told.put, at_once=True)
    assert told.get(timeout=SOON_S) == {"lab.owl": "one"}
    with pytest.raises(Empty):
        told.get(timeout=LONG_S)
    watch.close()


def test_what_editors_keep_is_not_noticed(tmp_path: Path) -> None:
    """The first that is told of is the file itself, though others were saved before."""
    with watched(tmp_path) as told:
        for name in (".lab.owl.swp", "lab.owl~", "#lab.owl#"):
            (tmp_path / name).write_text("", encoding="utf-8")
        with pytest.raises(Empty):
            told.get(timeout=LONG_S)
        (tmp_path / "lab.owl").write_text("one", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "one"}


def test_what_is_behind_links_is_noticed(tmp_path: Path) -> None:
    """A file that is a link to another, and a folder that is a link which is turned to another folder."""
    old, new, file, link = (tmp_path / name for name in ("old", "new", "elsewhere.owl", "now"))
    old.mkdir()
    new.mkdir()
    file.write_text("one", encoding="utf-8")
    (old / "lab.owl").symlink_to(file)
    (new / "lab.owl").write_text("new", encoding="utf-8")
    link.symlink_to(old)
    with watched(link) as told:
        file.write_text("two", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "two"}
        (tmp_path / "next").symlink_to(new)
        (tmp_path / "next").replace(link)
        assert told.get(timeout=SOON_S) == {"lab.owl": "new"}


def test_a_folder_that_goes_and_comes(tmp_path: Path) -> None:
    """Renamed, it holds nothing any more; another in its place is watched on."""
    folder = tmp_path / "now"
    folder.mkdir()
    (folder / "lab.owl").write_text("one", encoding="utf-8")
    with watched(folder) as told:
        folder.rename(tmp_path / "before")
        assert told.get(timeout=SOON_S) == {}
        folder.mkdir()
        (folder / "lab.owl").write_text("two", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "two"}
        (folder / "lab.owl").write_text("three", encoding="utf-8")
        assert told.get(timeout=SOON_S) == {"lab.owl": "three"}


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    """It is named."""
    with pytest.raises(FileNotFoundError, match="nowhere"):
        FolderWatch(tmp_path / "nowhere", dict, lambda found: None)
