"""The repository: what it takes in, finds and gives out, who may do it, and what remains after a crash."""

from __future__ import annotations

import hashlib
import io
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import pytest

from kb.problems import OntologyRejected
from kb.repository.access import AccessRefused, Role, User
from kb.repository.items import BadItem, Description, Item, ItemKind, NoSuchItem, RepositoryDamaged
from kb.repository.repository import OWNER, Limits, Repository
from tests.kb.repository.made import beeps, individual, song, text

ROOT = Path(__file__).parents[3]
TIME = datetime(2026, 5, 1, 12, 30, tzinfo=UTC)
BEEPS = {"tasks/beeps.owl": beeps()}
DUET = {"tasks/duet.owl": song("Duet", 2)}


@pytest.fixture
def repository(tmp_path: Path) -> Repository:
    """An empty one, on the first of May."""
    return Repository(tmp_path / "repository", lambda: TIME)


def upload(
    repository: Repository,
    name: str,
    files: Mapping[str, str | bytes],
    kind: ItemKind = ItemKind.ONTOLOGY,
    who: User = OWNER,
    *,
    description: str = "",
    tags: tuple[str, ...] = (),
    site: str = "",
) -> Item:
    """Upload texts."""
    about = Description(name=name, kind=kind, description=description, tags=tags, site=site)
    streams = {p: io.BytesIO(t.encode() if isinstance(t, str) else t) for p, t in files.items()}
    return repository.upload(who, about, streams)


def blobs(repository: Repository, tmp_path: Path) -> list[str]:
    """The hashes of the contents that are kept."""
    return sorted(p.parent.name + p.name for p in (tmp_path / "repository" / "blobs").glob("*/*"))


# What is taken in


def test_an_item_is_taken_in_with_what_it_needs(repository: Repository) -> None:
    """Version, time, user, hashes, needs and required capabilities are known."""
    upload(repository, "tue/Beeps", BEEPS)
    item = upload(repository, "tue/Duet", DUET, ItemKind.RECIPE, description="Two beeps", tags=("sound", "a"))
    assert (item.id, item.created, item.uploaded_by) == ("tue/Duet@1", "2026-05-01T12:30:00+00:00", "owner")
    assert item.needs == ("tue/Beeps@1",)
    assert item.capabilities == ("RobotWithKinect",)
    assert item.about.tags == ("a", "sound")
    [file] = item.files
    content = DUET["tasks/duet.owl"].encode()
    assert (file.sha256, file.size) == (hashlib.sha256(content).hexdigest(), len(content))
    assert file.iri == "http://example.org/made/duet.owl"
    assert repository.item(OWNER, "tue/Duet") == item


def test_a_change_is_a_version_and_the_same_again_is_none(repository: Repository, tmp_path: Path) -> None:
    """Old versions stay as they were; equal contents are kept once."""
    first = upload(repository, "tue/Beeps", BEEPS)
    assert upload(repository, "tue/Beeps", BEEPS) == first
    assert upload(repository, "tue/Beeps", {**BEEPS, "maps/noise.bin": b"\0\1"}).version == 2
    assert repository.item(OWNER, "tue/Beeps", 1) == first
    assert [i.version for i in repository.versions(OWNER, "tue/Beeps")] == [2, 1]
    assert len(blobs(repository, tmp_path)) == 2


@pytest.mark.parametrize(
    ("files", "kind", "says"),
    [
        ({}, ItemKind.ONTOLOGY, "has no files"),
        ({"map.pgm": "P5"}, ItemKind.ENVIRONMENT, "has no ontology"),
        ({"../beeps.owl": beeps()}, ItemKind.ONTOLOGY, "is no place for a file"),
        ({"/etc/beeps.owl": beeps()}, ItemKind.ONTOLOGY, "is no place for a file"),
        ({"a\\..\\beeps.owl": beeps()}, ItemKind.ONTOLOGY, "is no place for a file"),
        ({".hidden/beeps.owl": beeps()}, ItemKind.ONTOLOGY, "is no place for a file"),
        ({"a\0.owl": beeps()}, ItemKind.ONTOLOGY, "is no place for a file"),
        ({"A.owl": beeps(), "a.owl": song("Duet", 2)}, ItemKind.ONTOLOGY, "are the same file to some systems"),
        ({"a": "", "a/b.owl": beeps()}, ItemKind.ONTOLOGY, "cannot be a file and a folder"),
        ({"a.owl": beeps(), "b.owl": beeps()}, ItemKind.ONTOLOGY, "give one another IRI"),
        (DUET, ItemKind.RECIPE, "imports http://example.org/made/beeps.owl, which is neither"),
        (BEEPS, ItemKind.RECIPE, "has at least one CompositeProcess"),
        (BEEPS, ItemKind.ROBOT, "has at least one class below Robot"),
        (BEEPS, ItemKind.ENVIRONMENT, "has at least one Area or Location"),
    ],
)
def test_what_is_no_item_is_refused(
    files: dict[str, str], kind: ItemKind, says: str, repository: Repository, tmp_path: Path
) -> None:
    """The message tells why, and so does the log; nothing is left of it."""
    with pytest.raises(BadItem, match=says):
        upload(repository, "tue/Thing", files, kind)
    with pytest.raises(NoSuchItem):
        repository.item(OWNER, "tue/Thing")
    assert blobs(repository, tmp_path) == []
    assert list((tmp_path / "repository" / "incoming").iterdir()) == []
    assert says.split()[0] in repository.log(OWNER)[-1].refused


@pytest.mark.parametrize("name", ["Duet", "tue/", "TUE/Duet", "../Duet", "tue/a/b", "tue/.x", "tue/Duet\n"])
def test_a_bad_name_is_refused(name: str, repository: Repository) -> None:
    """Names may become parts of addresses."""
    with pytest.raises(BadItem, match="name items namespace/name"):
        upload(repository, name, BEEPS)


def test_a_wrong_ontology_is_refused_with_its_line(repository: Repository) -> None:
    """The file is named as the uploader named it."""
    with pytest.raises(OntologyRejected, match=r"^tasks/beeps\.owl:\d+ KB001 error"):
        upload(repository, "tue/Beeps", {"tasks/beeps.owl": beeps()[:-5]})
    with pytest.raises(OntologyRejected, match=r"^tasks/beeps\.owl:\d+ KB011 error Beep:.*did you mean duration_s"):
        upload(repository, "tue/Beeps", {"tasks/beeps.owl": beeps().replace("duration_s", "duratoin_s")})


def test_limits_and_hashes_are_kept(tmp_path: Path) -> None:
    """Too much, too many, and what was changed on the way is refused."""
    repository = Repository(tmp_path, lambda: TIME, limits=Limits(item_bytes=5000, files=2))
    with pytest.raises(BadItem, match=r"big\.bin is larger than .* bytes"):
        upload(repository, "tue/Beeps", {**BEEPS, "big.bin": b"x" * 4000})
    with pytest.raises(BadItem, match="at most 2 are taken"):
        upload(repository, "tue/Beeps", {**BEEPS, "a": "", "b": ""})
    about = Description(name="tue/Beeps", kind=ItemKind.ONTOLOGY)
    with pytest.raises(BadItem, match="should have the hash 00, but it came as"):
        repository.upload(OWNER, about, {"b.owl": io.BytesIO(beeps().encode())}, sha256={"b.owl": "00"})


def test_an_ontology_belongs_to_one_item(repository: Repository) -> None:
    """A second item with the same IRI would clash with it wherever both are used; not when the first is retired."""
    upload(repository, "tue/Beeps", BEEPS)
    with pytest.raises(BadItem, match="as tue/Beeps does"):
        upload(repository, "other/Beeps", BEEPS)
    repository.retire(OWNER, "tue/Beeps", "moved")
    assert upload(repository, "other/Beeps", BEEPS).version == 1
    with pytest.raises(BadItem, match="as other/Beeps does"):
        repository.restore(OWNER, "tue/Beeps", 1)


# What is found and given out


def test_items_are_found(repository: Repository) -> None:
    """By words of names, labels, comments and descriptions, by kind, capability, site and tag; the newest only."""
    upload(repository, "tue/Beeps", BEEPS)
    upload(repository, "tue/Duet", DUET, ItemKind.RECIPE, tags=("sound",), site="tue_lab")
    upload(repository, "tue/Duet", DUET, ItemKind.RECIPE, tags=("sound",), site="tue_lab", description="Two beeps")

    def found(*arguments: str, **conditions: str) -> list[str]:
        kind = ItemKind(conditions.pop("kind")) if "kind" in conditions else None
        return [i.id for i in repository.search(OWNER, *arguments, kind=kind, **conditions)]  # type: ignore[arg-type]

    assert found() == ["tue/Beeps@1", "tue/Duet@2"]
    assert found("welc") == ["tue/Duet@2"]
    assert found("beep heard") == ["tue/Beeps@1"]
    assert found("nothing") == found('zzz" OR "beep') == found("welcome", kind="robot") == []
    assert found(kind="recipe") == found(capability="RobotWithKinect", tag="sound") == found(site="tue_lab")
    repository.retire(OWNER, "tue/Duet", "too loud")
    assert found("duet") == ["tue/Duet@1"]


def test_a_download_is_whole_and_of_the_versions_that_were_checked(repository: Repository, tmp_path: Path) -> None:
    """What is needed comes with it, as it was when the item was taken in."""
    upload(repository, "tue/Beeps", BEEPS)
    upload(repository, "tue/Duet", DUET, ItemKind.RECIPE)
    upload(repository, "tue/Beeps", {"tasks/beeps.owl": beeps().replace("0.5", "0.75")})
    out = tmp_path / "new" / "folder"
    placed = repository.download(OWNER, "tue/Duet", out)
    assert placed.items == ("tue/Duet@1", "tue/Beeps@1")
    assert {p.relative_to(out).as_posix(): p.read_text() for p in placed.written} == DUET | BEEPS
    assert sorted(p for p in out.rglob("*") if p.is_file()) == list(placed.written)
    assert sorted(p.name for p in out.parent.iterdir()) == ["folder"]


def test_a_download_does_not_touch_what_is_there(repository: Repository, tmp_path: Path) -> None:
    """What it needs and is there stays; what is asked for and in the way stops it before anything is written."""
    upload(repository, "tue/Beeps", BEEPS)
    upload(repository, "tue/Duet", DUET, ItemKind.RECIPE)
    own = tmp_path / "own"
    (own / "mine").mkdir(parents=True)
    mine = own / "mine" / "noises.owl"
    mine.write_text(beeps().replace("0.5", "0.25"))
    placed = repository.download(OWNER, "tue/Duet", own)
    assert placed.written == (own / "tasks" / "duet.owl",)
    assert placed.kept == (mine,)
    assert repository.download(OWNER, "tue/Duet", own).written == ()
    (own / "tasks" / "duet.owl").write_text("mine")
    before = {p: p.read_bytes() for p in own.rglob("*") if p.is_file()}
    with pytest.raises(BadItem, match=r"is in the way of tasks/duet\.owl"):
        repository.download(OWNER, "tue/Duet", own)
    assert {p: p.read_bytes() for p in own.rglob("*") if p.is_file()} == before


def test_a_link_does_not_lead_a_download_out(repository: Repository, tmp_path: Path) -> None:
    """Even one that somebody has put into the folder."""
    upload(repository, "tue/Beeps", BEEPS)
    own, elsewhere = tmp_path / "own", tmp_path / "elsewhere"
    own.mkdir()
    elsewhere.mkdir()
    (own / "tasks").symlink_to(elsewhere)
    with pytest.raises(BadItem, match="a link leads there"):
        repository.download(OWNER, "tue/Beeps", own)
    assert list(elsewhere.iterdir()) == []


def test_damage_on_the_disk_is_noticed(repository: Repository, tmp_path: Path) -> None:
    """A content that has changed is not given out, and a download leaves nothing behind."""
    item = upload(repository, "tue/Beeps", BEEPS)
    sha256 = item.files[0].sha256
    with repository.open_file(OWNER, "tue/Beeps", 1, "tasks/beeps.owl") as stream:
        assert stream.read() == BEEPS["tasks/beeps.owl"].encode()
    kept = tmp_path / "repository" / "blobs" / sha256[:2] / sha256[2:]
    kept.chmod(0o644)
    kept.write_bytes(b"spoilt")
    with pytest.raises(RepositoryDamaged, match="has changed"):
        repository.download(OWNER, "tue/Beeps", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    with pytest.raises(RepositoryDamaged, match=r"has changed: its hash is .*; upload the same again"):
        repository.open_file(OWNER, "tue/Beeps", 1, "tasks/beeps.owl")
    kept.unlink()
    with pytest.raises(RepositoryDamaged, match="is gone"):
        repository.open_file(OWNER, "tue/Beeps", 1, "tasks/beeps.owl")


@pytest.mark.parametrize("spoilt", [b"spoilt", None])
def test_uploading_the_same_again_mends_damage(spoilt: bytes | None, repository: Repository, tmp_path: Path) -> None:
    """It is no new version, but its content is there again."""
    item = upload(repository, "tue/Beeps", BEEPS)
    sha256 = item.files[0].sha256
    kept = tmp_path / "repository" / "blobs" / sha256[:2] / sha256[2:]
    kept.chmod(0o644)
    kept.unlink()
    if spoilt is not None:
        kept.write_bytes(spoilt)
    assert upload(repository, "tue/Beeps", BEEPS) == item
    with repository.open_file(OWNER, "tue/Beeps", 1, "tasks/beeps.owl") as stream:
        assert stream.read() == BEEPS["tasks/beeps.owl"].encode()


def test_what_is_retired_tells_what_to_take_instead(repository: Repository) -> None:
    """It is not found, but can be read by its number, and restored."""
    upload(repository, "tue/Beeps", BEEPS)
    upload(repository, "tue/Duet", DUET, ItemKind.RECIPE)
    retired = repository.retire(OWNER, "tue/Duet", "too loud", superseded_by="tue/Beeps")
    assert (retired.retired, retired.superseded_by) == ("too loud", "tue/Beeps")
    with pytest.raises(NoSuchItem, match="the last as: too loud; take tue/Beeps instead"):
        repository.item(OWNER, "tue/Duet")
    with pytest.raises(BadItem, match="retired already"):
        repository.retire(OWNER, "tue/Duet", "again", version=1)
    assert repository.restore(OWNER, "tue/Duet", 1) == repository.item(OWNER, "tue/Duet")


# Who may do what


def test_rights_are_of_namespaces(repository: Repository) -> None:
    """Readers read, contributors change what is theirs, curators everything; each refusal says why and is noted."""
    users = {name: repository.enter(name, repository.add_user(OWNER, name)) for name in ("ann", "bob", "eve")}
    ann, bob, eve = users["ann"], users["bob"], users["eve"]
    repository.grant(OWNER, "ann", "tue", Role.CONTRIBUTOR)
    repository.grant(OWNER, "bob", "tue", Role.CONTRIBUTOR)
    repository.grant(OWNER, "eve", "other", Role.CURATOR)
    upload(repository, "tue/Beeps", BEEPS, who=ann)
    with pytest.raises(AccessRefused, match="which is by ann: that takes a curator of tue, and bob is contributor"):
        upload(repository, "tue/Beeps", {"b.owl": beeps()}, who=bob)
    with pytest.raises(AccessRefused, match="which is by ann"):
        repository.retire(bob, "tue/Beeps", "mine is better")
    with pytest.raises(AccessRefused, match="eve has no role there"):
        upload(repository, "tue/Mine", BEEPS, who=eve)
    with pytest.raises(NoSuchItem, match="that eve may read"):
        repository.item(eve, "tue/Beeps")
    assert repository.search(eve) == []
    with pytest.raises(BadItem, match="as far as you may read"):
        upload(repository, "other/Duet", DUET, ItemKind.RECIPE, eve)
    with pytest.raises(AccessRefused, match="say who may do what"):
        repository.grant(ann, "ann", "tue", Role.CURATOR)
    repository.grant(OWNER, "anyone", "tue", Role.READER)
    assert [i.id for i in repository.search(eve)] == ["tue/Beeps@1"]
    assert upload(repository, "other/Duet", DUET, ItemKind.RECIPE, eve).needs == ("tue/Beeps@1",)
    with pytest.raises(AccessRefused, match="not everybody can be curator"):
        repository.grant(OWNER, "anyone", "tue", Role.CURATOR)
    repository.grant(OWNER, "bob", "tue", Role.CURATOR)
    assert upload(repository, "tue/Beeps", {"b.owl": beeps()}, who=bob).version == 2
    repository.grant(OWNER, "ann", "tue", Role.NONE)
    with pytest.raises(AccessRefused):
        repository.retire(ann, "tue/Beeps", "no more")
    refused = [e for e in repository.log(OWNER) if e.refused]
    assert ("eve", "upload", "tue/Mine") in {(e.user, e.did, e.to_what) for e in refused}
    with pytest.raises(AccessRefused, match="read the log"):
        repository.log(eve)


def test_tokens_are_checked_and_not_kept(repository: Repository, tmp_path: Path) -> None:
    """A new token ends the old one; no file of the repository holds one."""
    old = repository.add_user(OWNER, "ann")
    new = repository.add_user(OWNER, "ann")
    assert repository.enter("ann", new) == User(name="ann")
    for name, token in (("ann", old), ("ann", ""), ("bob", new), ("anyone", new)):
        with pytest.raises(AccessRefused, match="do not belong together"):
            repository.enter(name, token)
    files = b"".join(p.read_bytes() for p in (tmp_path / "repository").rglob("*") if p.is_file())
    assert b"ann" in files
    assert new.encode() not in files
    with pytest.raises(AccessRefused, match="is no name for a user"):
        repository.add_user(OWNER, "anyone")


def test_a_user_who_is_removed_has_no_rights_left(repository: Repository) -> None:
    """Nor the token; who comes back under the name begins anew, and what was uploaded stays."""
    token = repository.add_user(OWNER, "ann")
    repository.grant(OWNER, "ann", "tue", Role.CONTRIBUTOR)
    ann = repository.enter("ann", token)
    item = upload(repository, "tue/Beeps", BEEPS, who=ann)
    with pytest.raises(AccessRefused, match="may not remove users"):
        repository.remove_user(ann, "ann")
    repository.remove_user(OWNER, "ann")
    with pytest.raises(AccessRefused, match="do not belong together"):
        repository.enter("ann", token)
    with pytest.raises(AccessRefused, match="is no user"):
        repository.remove_user(OWNER, "ann")
    repository.add_user(OWNER, "ann")
    with pytest.raises(NoSuchItem):
        repository.item(ann, "tue/Beeps")
    assert repository.item(OWNER, "tue/Beeps") == item


def test_texts_that_are_none_are_refused(repository: Repository) -> None:
    """Half a pair of surrogates, or a NUL, is no name, word or token; what is in the log of it is cut."""
    upload(repository, "tue/Beeps", BEEPS)
    half = "\ud800"
    assert repository.search(OWNER, "be\0eps") == []
    with pytest.raises(BadItem, match="is no text"):
        repository.search(OWNER, half)
    for name, token in ((half, "x"), ("ann", half), ("x" * 1_000_000, "x"), ("a\0b", "x")):
        with pytest.raises(AccessRefused, match="do not belong together"):
            repository.enter(name, token)
    with pytest.raises(BadItem):
        upload(repository, half * 1_000_000, BEEPS)
    assert max(len(entry.to_what + entry.refused) for entry in repository.log(OWNER)) <= 2000


def test_strangers_do_not_fill_the_log(repository: Repository, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of refused entries the last are kept, and of all else everything."""
    monkeypatch.setattr("kb.repository.repository._ENTERS_LOGGED", 3)
    upload(repository, "tue/Beeps", BEEPS)
    for number in range(10):
        with pytest.raises(AccessRefused):
            repository.enter(f"user_{number}", "x")
    entries = [(entry.did, entry.user) for entry in repository.log(OWNER)]
    assert entries == [("enter", f"user_{n}") for n in (9, 8, 7)] + [("upload", "owner")]


def test_files_that_are_read_are_in_the_log(repository: Repository) -> None:
    """And those that somebody may not read."""
    upload(repository, "tue/Beeps", BEEPS)
    repository.open_file(OWNER, "tue/Beeps", 1, "tasks/beeps.owl").close()
    with pytest.raises(NoSuchItem):
        repository.open_file(User(name="bob"), "tue/Beeps", 1, "tasks/beeps.owl")
    [refused, done] = repository.log(OWNER)[:2]
    assert (done.did, done.to_what, done.refused) == ("download", "tue/Beeps@1 tasks/beeps.owl", "")
    assert (refused.user, refused.did, bool(refused.refused)) == ("bob", "download", True)


def test_a_search_gives_as_many_as_are_asked_for(repository: Repository) -> None:
    """The newest version of each in use, by name."""
    upload(repository, "tue/Beeps", BEEPS)
    for name in ("tue/A", "tue/B", "tue/C"):
        for about in ("first", "second"):
            upload(repository, name, {f"tasks/{name[-1]}.owl": song(name[-1], 2)}, description=about)
    found = repository.search(OWNER, limit=2)
    assert [(item.id, item.about.description) for item in found] == [("tue/A@2", "second"), ("tue/B@2", "second")]


# Many at once, and crashes


def test_writers_do_not_disturb_each_other(repository: Repository, tmp_path: Path) -> None:
    """Uploads of one name at the same time become versions without a gap, from threads and from processes."""
    upload(repository, "tue/Beeps", BEEPS)

    def one(number: int) -> int:
        return upload(
            Repository(tmp_path / "repository", lambda: TIME), "tue/Beeps", BEEPS | {"n": str(number)}
        ).version

    with ThreadPoolExecutor(4) as pool:
        versions = list(pool.map(one, range(4)))
    children = [child(tmp_path / "repository", f"upload({n!r})") for n in ("a", "b")]
    for process in children:
        process.communicate()
    assert [process.returncode for process in children] == [0, 0]
    assert sorted(versions) == [2, 3, 4, 5]
    assert [i.version for i in repository.versions(OWNER, "tue/Beeps")] == [7, 6, 5, 4, 3, 2, 1]


CHILD = """
import io, os, signal, sys
from datetime import UTC, datetime
from pathlib import Path
from kb.repository import tables
from kb.repository.items import Description, ItemKind
from kb.repository.repository import OWNER, Repository
from tests.kb.repository.made import beeps

repository = Repository(Path(sys.argv[1]), lambda: datetime(2026, 5, 1, tzinfo=UTC))

class Endless(io.RawIOBase):
    told = False
    def read(self, size=-1):
        if not self.told:
            self.told = True
            print("writing", flush=True)
        return b"x" * size

def killed(*_):
    os.kill(os.getpid(), signal.SIGKILL)

def upload(n, extra=None):
    about = Description(name="tue/Beeps", kind=ItemKind.ONTOLOGY)
    files = {"tasks/beeps.owl": io.BytesIO(beeps().encode()), "n": extra or io.BytesIO(n.encode())}
    repository.upload(OWNER, about, files)

"""


def child(folder: Path, does: str) -> subprocess.Popen[str]:
    """A process that does something with a repository."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", CHILD + does, str(folder)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize(
    ("does", "waits"),
    [
        ("upload('x', Endless())", True),
        ("tables.insert = killed; upload('x')", False),
    ],
)
def test_a_killed_upload_leaves_nothing_half(does: str, waits: bool, repository: Repository, tmp_path: Path) -> None:
    """Neither one that is receiving nor one that is about to commit; the next upload sweeps up behind it."""
    before = upload(repository, "tue/Beeps", BEEPS)
    kept = blobs(repository, tmp_path)
    with child(tmp_path / "repository", does) as process:
        if waits:
            assert process.stdout is not None
            assert process.stdout.readline() == "writing\n"
            process.kill()
        assert process.wait() == -signal.SIGKILL
    assert repository.versions(OWNER, "tue/Beeps") == [before]
    repository.sweep(OWNER)
    assert blobs(repository, tmp_path) == kept
    upload(repository, "tue/Beeps", BEEPS | {"n": "y"})
    assert list((tmp_path / "repository" / "incoming").iterdir()) == []
    assert [i.version for i in repository.versions(OWNER, "tue/Beeps")] == [2, 1]


def test_models_and_maps_are_items_too(repository: Repository) -> None:
    """A room with its map, and a class of robots."""
    room = text("rooms", [individual("rooms", "attic", "Room")])
    item = upload(repository, "tue/Attic", {"sites/rooms.owl": room, "sites/attic.pgm": b"P5"}, ItemKind.ENVIRONMENT)
    assert [f.iri for f in item.files] == ["", "http://example.org/made/rooms.owl"]
