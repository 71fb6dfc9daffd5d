"""Files are written whole or not at all, one and several, whatever fails and whoever is killed on the way."""

import fcntl
import json
import os
import random
import signal
import threading
import time
from contextlib import suppress
from functools import partial

import pytest

from capture_plan.errors import PlanError
from capture_plan.output import (
    refuse_another,
    refuse_folder,
    refuse_place,
    refuse_plan,
    replace_whole,
    write_whole,
    written_together,
)
from capture_plan.output.leavings import OURS, alone_in, digest_of, sweep
from capture_plan.output.together import MEMORY
from capture_plan.progress import listen
from tests.faults import FailingDisk, tree

MADE = f"{OURS}{'0' * 16}"
ERRORS = (OSError(28, "No space left on device"), MemoryError(), KeyboardInterrupt())


def write_set(folder, generation, pages=3):
    with written_together(folder) as new:
        write_whole(new / "book.pdf", f"book {generation}".encode() * 99)
        for page in range(pages):
            write_whole(new / "pages" / f"{page}.png", f"page {page} of {generation}".encode() * 99)


def write_one(folder, generation):
    write_whole(folder / "deep" / "plan.json", f"plan {generation}".encode() * 99)


def replace_one(folder, generation):
    replace_whole(folder / "deep" / "plan.json", f"plan {generation}".encode() * 99)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("ever", [False, True], ids=["once", "from_then_on"])
@pytest.mark.parametrize("write", [write_one, write_set, replace_one])
@pytest.mark.parametrize("stood", [False, True], ids=["new", "replaced"])
def test_whatever_call_fails_there_are_the_old_files_or_the_new_ones(tmp_path, monkeypatch, write, stood, ever, error):
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    after = tmp_path / "after"
    after.mkdir()
    if stood:
        write(after, 1)
    before = tree(after)
    write(after, 2)
    retained = before | {name: text for name, text in tree(after).items() if "~" in name}
    disk, n = FailingDisk(), 1
    while disk.calls >= n - 1:
        folder = tmp_path / str(n)
        folder.mkdir()
        if stood:
            write(folder, 1)
        with monkeypatch.context() as patched:
            disk = FailingDisk(n, error, ever=ever).at(patched)
            with suppress(PlanError, MemoryError, KeyboardInterrupt):
                write(folder, 2)
        for each in (folder, folder / "deep"):
            sweep(each)  # as whoever writes there next
        assert tree(folder) in (before, retained, tree(after))
        assert not [path for path in folder.rglob("*") if path.name.startswith(OURS)]
        n += 1
    assert n > 8
    assert tree(folder) == tree(after)


def forked(work):
    if child := os.fork():
        return child
    try:
        work()
    finally:
        os._exit(0)


def for_ever(write, folder, first=0):
    generation = first
    while True:
        generation += 1
        write(folder, generation)


def test_what_a_killed_writer_leaves_is_whole_and_swept(tmp_path):
    seed = random.Random(5)
    for _ in range(40):
        child = forked(lambda: for_ever(write_set, tmp_path))
        time.sleep(seed.uniform(0.0, 0.02))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        sweep(tmp_path)
        found = tree(tmp_path)
        generations = {bytes(text).split(b"page")[0].split(b"book ")[-1] for text in (found.get("book.pdf", b""),)}
        generations |= {text.split(b" of ")[1].split(b"page")[0] for name, text in found.items() if name[-1] == "g"}
        assert len(generations) == 1
        assert not [path for path in tmp_path.rglob("*") if path.name.startswith(OURS)]
    write_set(tmp_path, "last")
    assert tree(tmp_path)["pages/1.png"] == b"page 1 of last" * 99


def test_of_two_writers_each_reader_sees_whole_files_of_one(tmp_path):
    write_one(tmp_path, 0)
    children = [forked(partial(for_ever, write_one, tmp_path, first)) for first in (0, 1_000)]
    try:
        for _ in range(3_000):
            text = (tmp_path / "deep" / "plan.json").read_bytes()
            assert text == text[: len(text) // 99] * 99
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def test_only_what_we_wrote_and_do_not_write_now_is_taken_away(tmp_path):
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "photo.jpg").write_bytes(b"a person's")
    write_set(tmp_path, 1, pages=5)
    (tmp_path / "pages" / "4.png").write_bytes(b"painted over")
    write_set(tmp_path, 2, pages=3)
    names = set(tree(tmp_path)) - {MEMORY, f"pages/{MEMORY}"}
    assert names == {"book.pdf", "pages/0.png", "pages/1.png", "pages/2.png", "pages/4.png", "pages/photo.jpg"}


def test_what_somebody_changed_is_kept_beside(tmp_path):
    write_set(tmp_path, 1)
    (tmp_path / "book.pdf").write_bytes(b"notes in it")
    write_set(tmp_path, 2)
    assert (tmp_path / "book.pdf~").read_bytes() == b"notes in it"
    assert (tmp_path / "book.pdf").read_bytes() == b"book 2" * 99
    (tmp_path / "book.pdf").write_bytes(b"other notes")
    write_set(tmp_path, 3)
    assert [(tmp_path / f"book.pdf{retained}").read_bytes() for retained in ("~2", "~")] == [
        b"notes in it",
        b"other notes",
    ]
    assert not (tmp_path / "pages" / "0.png~").exists()


def test_a_set_within_a_set_is_moved_with_it(tmp_path):
    with suppress(ZeroDivisionError), written_together(tmp_path) as new:
        write_set(new / "sheets", 1)
        raise ZeroDivisionError
    assert tree(tmp_path) == {}
    with written_together(tmp_path) as new:
        write_set(new / "sheets", 1)
    assert (tmp_path / "sheets" / "book.pdf").read_bytes() == b"book 1" * 99


@pytest.mark.parametrize(
    "name", ["../mine.txt", "sub/../../mine.txt", "{here}/mine.txt", "link/mine.txt", "sub/link/mine.txt"]
)
@pytest.mark.parametrize("before", [False, True])
def test_a_list_of_moves_that_came_from_outside_leads_nowhere_else(tmp_path, name, before):
    (tmp_path / "mine.txt").write_text("mine")
    made = tmp_path / "received" / MADE
    (made / "old" / "old").mkdir(parents=True)
    (made / "mine.txt").write_text("theirs")
    (made.parent / "sub").mkdir()
    for link in ("link", "sub/link"):
        (made.parent / link).symlink_to(tmp_path)
    (made / "moves.json").write_text(
        json.dumps({name.format(here=tmp_path): (digest_of(tmp_path / "mine.txt") if before else None, None)})
    )
    sweep(made.parent)
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert not made.exists()


@pytest.mark.parametrize("text", ["", "[1]", "3", '{"a": ', "[" * 9_000])
def test_a_list_of_moves_that_is_none_is_swept_all_the_same(tmp_path, text):
    (tmp_path / MADE).mkdir()
    (tmp_path / MADE / "moves.json").write_text(text)
    write_set(tmp_path, 1)
    assert not list(tmp_path.glob(f"{OURS}*"))


def test_no_link_is_written_through(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "pages").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(PlanError, match="is a link"):
        write_set(tmp_path / "out", 1)
    assert tree(tmp_path / "elsewhere") == {}
    assert not (tmp_path / "out" / "book.pdf").exists()


def test_what_is_replaced_is_kept_unless_it_is_the_same(tmp_path):
    path = tmp_path / "plan.json"
    assert [replace_whole(path, text) for text in (b"one", b"one")] == [[], []]
    for text in (b"two", b"three", b"one", b"four"):
        said = replace_whole(path, text)
    assert tree(tmp_path) == {
        "plan.json": b"four",
        "plan.json~": b"one",
        "plan.json~2": b"one",
        "plan.json~3": b"two",
        "plan.json~4": b"three",
    }
    assert said == [f"kept {path}~ as {path}~4", f"kept {path} as {path}~"]


def test_of_two_who_replace_one_file_nobody_loses_what_was_there(tmp_path):
    def replace(writer):
        for n in range(20):
            replace_whole(tmp_path / "plan.json", f"{writer} {n}".encode())

    for child in [forked(partial(replace, writer)) for writer in "ab"]:
        assert os.waitpid(child, 0)[1] == 0
    assert set(tree(tmp_path).values()) == {f"{writer} {n}".encode() for writer in "ab" for n in range(20)}


def test_places_that_may_not_be_written_are_refused(tmp_path):
    rig, folder, link, pipe = (tmp_path / name for name in ("rig.npz", "folder", "link", "pipe"))
    rig.write_bytes(b"")
    folder.mkdir()
    link.symlink_to(rig)
    os.mkfifo(pipe)
    for place, reason in (
        (rig, "is what is read"), (folder, "is a folder"), (link, "is a link"), (pipe, "is a device"),
        (rig / "plan.json", "which is a file"),
    ):  # fmt: skip
        with pytest.raises(PlanError, match=reason):
            refuse_place(place, inputs=[rig])
    with pytest.raises(PlanError, match="is a file"):
        refuse_folder(rig, ())
    refuse_place(tmp_path / "new" / "plan.json", inputs=[rig])


def test_a_set_that_would_write_over_or_take_away_what_is_read_is_refused(tmp_path):
    rig, frame, mine = (tmp_path / name for name in ("out/expressions", "out/pages/take/1.obj", "out/hero.glb"))
    for place in (rig / "neutral.obj", frame, mine):
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(b"")
    (tmp_path / "link").symlink_to(frame.parent)
    names = ("plan.json", "expressions", "pages")
    for read in (rig, rig / "neutral.obj", frame, frame.parent, tmp_path / "link", tmp_path / "out"):
        with pytest.raises(PlanError, match="is what is read"):
            refuse_folder(tmp_path / "out", names, inputs=[read])
    refuse_folder(tmp_path / "out", names, inputs=[mine, "frontal", tmp_path, None])
    for name in ("neutral.obj", "audit.txt"):
        with pytest.raises(PlanError, match="is read"):
            refuse_place(rig / name, inputs=[rig])
    refuse_place(rig / "plan.json", inputs=[rig])


def test_a_plan_is_replaced_by_plans_alone_and_by_a_set_that_wrote_it(tmp_path):
    text = b'{"format": 0, "rig": {}, "settings": {}, "layout": {}, "packing": {}}'
    (tmp_path / "plan.json").write_bytes(text)
    for refuse in (refuse_place, refuse_plan):
        with pytest.raises(PlanError, match="holds a plan"):
            refuse(tmp_path / "plan.json")
    refuse_place(tmp_path / "plan.json", over_plan=True)
    with written_together(tmp_path / "set") as new:
        write_whole(new / "plan.json", text)
    refuse_plan(tmp_path / "set" / "plan.json")


def test_what_shows_one_head_does_not_take_the_place_of_what_shows_another(tmp_path):
    refuse_another(tmp_path, "hero")
    with written_together(tmp_path, "hero") as new:
        write_whole(new / "sheets.pdf", b"hero")
    refuse_another(tmp_path, "hero")
    with pytest.raises(PlanError, match="shows 'hero', this is 'villain': choose another place with -o"):
        refuse_another(tmp_path, "villain")
    (tmp_path / ".capture-plan.json").write_text('{"of": 3}')
    refuse_another(tmp_path, "villain")


def test_only_names_that_nobody_else_gives_are_swept(tmp_path):
    mine = [tmp_path / f"{OURS}settings.toml", tmp_path / f"{OURS}work" / "notes.txt", tmp_path / f"{OURS}{'0' * 15}"]
    mine[1].parent.mkdir()
    for path in mine:
        path.write_text("mine")
    os.mkfifo(tmp_path / f"{OURS}fifo")
    with written_together(tmp_path / f"{OURS}work") as new:  # a folder like any other: what is a person's is kept
        write_whole(new / "notes.txt", b"ours")
    write_whole(tmp_path / "other.txt", b"ours")
    assert [path.read_text() for path in (mine[0], mine[1].with_name("notes.txt~"), mine[2])] == ["mine"] * 3


@pytest.mark.parametrize("listed", [False, True, [None, None], [None, "0" * 64], ["0" * 64, "0" * 64]])
def test_a_set_from_outside_takes_no_file_away(tmp_path, listed):
    made = tmp_path / MADE
    (made / "old").mkdir(parents=True)
    (made / "old" / "mine.txt").write_text("theirs")
    (tmp_path / "mine.txt").write_text("mine")
    (made / "moves.json").write_text(json.dumps({"mine.txt": listed}))
    write_whole(tmp_path / "other.txt", b"ours")
    assert (tmp_path / "mine.txt").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.txt", "other.txt"]


@pytest.mark.parametrize("since", [None, "what I wrote since"])
def test_what_a_person_wrote_after_a_kill_stays_and_what_stood_before_is_kept(tmp_path, since):
    made = tmp_path / MADE
    (made / "old").mkdir(parents=True)
    (made / "old" / "a.txt").write_text("before")
    (tmp_path / "a.txt").write_text("moved")
    (tmp_path / "b.txt").write_text("moved too")
    digests = {name: digest_of(tmp_path / name) for name in ("a.txt", "b.txt")}
    moves = {"a.txt": (digest_of(made / "old" / "a.txt"), digests["a.txt"]), "b.txt": (None, digests["b.txt"])}
    (made / "moves.json").write_text(json.dumps(moves))
    if since:
        for name in ("a.txt", "b.txt"):
            (tmp_path / name).write_text(since)
    sweep(tmp_path)
    found = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert found == ({"a.txt": since, "b.txt": since, "a.txt~": "before"} if since else {"a.txt": "before"})


def test_who_waits_for_another_command_says_so(tmp_path):
    said, theirs = [], os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(theirs, fcntl.LOCK_EX)
    thread = threading.Timer(0.3, os.close, [theirs])
    thread.start()
    with listen(said.extend), alone_in(tmp_path):
        assert "another command" in said[0]
    thread.join()
    with listen(said.extend), alone_in(tmp_path):
        assert len(said) == 1


def test_files_of_one_thing_that_are_not_written_again_go_and_nothing_else_does(tmp_path):
    names = ("mask.stl", "mask-1.stl", "mask-2.stl", "mask-3.stl")

    def write(**files):
        with written_together(tmp_path, whole=names) as new:
            for name, content in files.items():
                (new / name.replace("_", "-")).with_suffix(".stl").write_bytes(content)

    with written_together(tmp_path) as new:
        (new / "plan.html").write_bytes(b"page")
    write(mask_1=b"one", mask_2=b"two", mask_3=b"three")
    (tmp_path / "mask-2.stl").write_bytes(b"sanded by hand")
    (tmp_path / "notes.stl").write_bytes(b"somebody else's")
    write(mask=b"whole")
    there = {path.name for path in tmp_path.iterdir() if not path.name.startswith(".")}
    assert there == {"mask.stl", "mask-2.stl", "notes.stl", "plan.html"}
    assert (tmp_path / "mask-2.stl").read_bytes() == b"sanded by hand"
