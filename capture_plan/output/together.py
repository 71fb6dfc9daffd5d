"""Several files, all or none.

They are made in a folder beside their places (`new/`), then moved there one by one; what stands there is kept in `old/`
until all have been moved, and put back where one cannot be. Each folder remembers in `.capture-plan.json` what we wrote
into it. What somebody else wrote, or changed since, is kept with `~` behind its name (`whole.keeping`). In folders of
the set, what we wrote before and do not write now is taken away, and so are files of one thing (`whole`).
"""

import json
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from capture_plan.errors import PlanError
from capture_plan.output.leavings import (
    MOVES,
    NEW,
    OLD,
    alone_in,
    digest_of,
    is_being_made,
    new_folder,
    put_back,
    release,
)
from capture_plan.output.places import HOLDS_A_PLAN, IS_A_LINK, holds_plan
from capture_plan.output.whole import flush, flush_folder, folder_of, in_one_line, keeping, write_whole
from capture_plan.progress import tell
from capture_plan.prose import in_series

MEMORY = ".capture-plan.json"
WRITTEN, OF, NUMBERS = "written by capture-plan", "of", "of plan"
OF_NO_PLAN = ".schema.json"
SHOWN = 60  # letters of a name


@contextmanager
def written_together(folder: Path, of: str = "", number: str = "", *, whole: Iterable[str] = ()) -> Iterator[Path]:
    """A folder to write into; once the block ends well all that is in it stands in `folder`. `of` names the head that
    it shows, where it shows one: `refuse_another` asks for it; `number` is the plan's that it was made of: what stays
    beside it of another plan is told. Files of the names `whole` are one thing: of those that we wrote before, what is
    not written now is taken away.

    Inside another such block nothing is moved twice: `folder` is then part of that one.

    Raises:
        PlanError: the place cannot be written, or a link stands in the way; all is as it was.
    """
    if is_being_made(folder):
        os.makedirs(folder, exist_ok=True)
        yield folder
        return
    with in_one_line(folder), folder_of(folder / NEW):
        made, lock = new_folder(folder)
        try:
            os.mkdir(made / NEW)
            yield made / NEW
            with alone_in(folder):
                move(made, of, number, set(whole))
        finally:
            if not (made / MOVES).exists():  # else it could not be put back now: the next sweep will
                shutil.rmtree(made, ignore_errors=True)
            release(lock)


def move(made: Path, of: str, number: str, whole: set[str]) -> None:
    """Move what is in `new/` to its places, with what it takes the place of kept; all of it or nothing."""
    new, folder = made / NEW, made.parent
    gone = remember(new, folder, files_in(new), of, number, whole)
    names = files_in(new)
    for name in names:
        flush(new / name)
    retained = {name: _keep(made, name) for name in (*names, *gone)}
    stood = {
        str(name): (digest_of(made / OLD / name) if stands else None, digest_of(new / name))
        for name, stands in retained.items()
    }
    missing = [each for each in {folder / name.parent for name in names} if not each.exists()]
    write_whole(made / MOVES, json.dumps(stood).encode())
    flush(made / MOVES)
    flush_folder(made)
    try:
        for name in names:
            os.makedirs((folder / name).parent, exist_ok=True)
            os.replace(new / name, folder / name)
        for name in gone:
            os.unlink(folder / name)
        for each in {folder / name.parent for name in names}:
            flush_folder(each)
        os.unlink(made / MOVES)
    except BaseException:
        put_back(made, stood)
        for each in sorted(missing, reverse=True):
            with suppress(OSError):
                os.rmdir(each)
        raise


def files_in(folder: Path) -> list[Path]:
    """All files, seen from the folder."""
    return [path.relative_to(folder) for path in sorted(folder.rglob("*")) if path.is_file()]


def _keep(made: Path, name: Path) -> bool:
    """Keep what stands at a place, in `old/`; False where nothing does."""
    if not (place := made.parent / name).exists():
        return False
    os.makedirs((made / OLD / name).parent, exist_ok=True)
    same_file(place, made / OLD / name)
    return True


def remember(new: Path, folder: Path, names: list[Path], of: str, number: str, whole: set[str]) -> list[Path]:
    """Write into each folder of the set what we wrote there; keep what is not ours beside it. Returns what we wrote
    into its folders before, and of the names `whole`, and do not write now."""
    gone = []
    for inside in sorted({name.parent for name in names}):
        refuse_links(folder, inside, [name for name in names if name.parent == inside])
        before, numbers = _ours(folder / inside), _ours(folder / inside, NUMBERS)
        now = {name.name: digest_of(new / name) or "" for name in names if name.parent == inside}
        for name in now:
            if (place := folder / inside / name).exists() and digest_of(place) not in (before.get(name), now[name]):
                for retained, old in keeping(place).items():
                    same_file(old, new / inside / retained.name)
                    tell([f"note: {old} was not as we wrote it: it is kept as {retained.name}"])
        left = [name for name in before if name not in now]
        old = [name for name in left if inside != Path() or name in whole]
        gone += [inside / name for name in old if unchanged(folder / inside / name, before[name])]
        left = [name for name in left if name not in old]
        memory = dict(sorted((now | {name: before[name] for name in left}).items()))
        others = {name: numbers[name] for name in left if name in numbers and (folder / inside / name).exists()}
        retained = {WRITTEN: memory} | ({OF: of} if of else {})
        if number:
            retained[NUMBERS] = dict.fromkeys(now, number) | others
            mixed = {name for name, one in others.items() if one != number and not name.endswith(OF_NO_PLAN)}
            tell_of_another_plan(folder / inside, mixed | folders_of_others(folder / inside, names, number), number)
        write_whole(new / inside / MEMORY, json.dumps(retained, indent=1).encode() + b"\n")
    return gone


def folders_of_others(folder: Path, names: list[Path], number: str) -> set[str]:
    """Folders inside, not written into now, that hold files of another plan than the one with this number."""
    now = {name.parts[0] for name in names if len(name.parts) > 1}
    inside = [place for place in folder.iterdir() if place.name not in now] if folder.is_dir() else []
    return {f"{place.name}/" for place in inside if set(_ours(place, NUMBERS).values()) - {number}}


def tell_of_another_plan(folder: Path, names: set[str], number: str) -> None:
    """Say which files of a folder are of another plan than the one with this number, that was now written."""
    if names:
        kept = in_series(sorted(names))
        tell(
            [f"note: {folder} now holds two plans: {kept} not of plan {number}; make them again, or choose another -o"]
        )


def _ours(folder: Path, what: str = WRITTEN) -> dict[str, str]:
    """Names of the files that we wrote into a folder, with their digests, or what else we remember of each."""
    try:
        files = json.loads((folder / MEMORY).read_bytes())[what]
        return {name: what for name, what in files.items() if Path(name).name == name and isinstance(what, str)}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def refuse_another(folder: Path, of: str) -> None:
    """Refuse to put what shows one head in the place of what shows another.

    Raises:
        PlanError: we have written such into the folder.
    """
    try:
        stands = json.loads((folder / MEMORY).read_bytes())[OF]
    except (OSError, ValueError, KeyError, TypeError):
        return
    if isinstance(stands, str) and stands != of:
        raise PlanError(f"{folder} shows '{stands[:SHOWN]}', this is '{of[:SHOWN]}': choose another place with -o")


def refuse_links(folder: Path, inside: Path, names: list[Path]) -> None:
    """Raise PlanError where one of the places, or a folder on the way, is a link."""
    for name in (inside, *inside.parents, *names):
        if (folder / name).is_symlink():
            raise PlanError(f"{folder / name} {IS_A_LINK}: remove it")


def refuse_plan(path: Path) -> None:
    """Refuse to put a file of a set in the place of a plan that none has written there.

    Raises:
        PlanError: there is such a plan.
    """
    if holds_plan(path) and path.name not in _ours(path.parent):
        raise PlanError(f"{path} {HOLDS_A_PLAN}: choose another place with -o")


def unchanged(path: Path, what: str) -> bool:
    """Whether a file still holds what we wrote."""
    return digest_of(path) == what


def same_file(place: Path, other: Path) -> None:
    """`other` is the file at `place` too; a copy where the file system knows no such thing."""
    try:
        os.link(place, other, follow_symlinks=False)
    except OSError:
        shutil.copy2(place, other, follow_symlinks=False)
