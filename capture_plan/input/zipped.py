"""Rigs inside a zip archive: a folder of any kind that is read here, or a single file, read in memory.

Nothing is unpacked to the disk. Before anything is read, the archive's directory is held against what a rig can be:
no path that leads out, no links, no passwords, no name twice, at most MOST_FILES files and MOST_BYTES in all, and
nothing large that was packed better than MOST_RATIO to one, as no mesh is. zipfile never gives more bytes than the
directory declares, so that a declared size that lies is an error and not a flood.
"""

import lzma
import stat
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from capture_plan.errors import RigError
from capture_plan.input.bounds import check_plain
from capture_plan.input.source import DEEPEST, MOST_FILES

MOST_BYTES = 2 << 30
MOST_RATIO, LARGE_BYTES = 150, 64 << 20  # text of meshes packs 3 to 8 to one; a sparse array of zeros is small or rare
DAMAGE = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, RuntimeError, NotImplementedError, struct.error)


@contextmanager
def open_zip(path: Path) -> Iterator[zipfile.Path]:
    """The root folder of the archive. RigError when it is none, was damaged, or is no honest one."""
    check_plain(path)
    try:
        with zipfile.ZipFile(path) as archive:
            check_directory(path, archive.infolist())
            yield zipfile.Path(archive)
    except (*DAMAGE, ValueError, KeyError, IndexError, OverflowError) as error:
        found = " ".join(str(error).split())[:100]
        raise RigError(
            f"{path.name} is not a zip archive, or it was cut off ({found}): zip or copy it again"
        ) from error


def check_directory(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    """RigError unless every entry is a plain file or folder in the archive, and all together are of a rig's size."""
    if len(entries) > MOST_FILES:
        most = f"expected at most {MOST_FILES:,}: zip only what is to be read"
        raise RigError(f"{path.name} holds {len(entries):,} files, {most}")
    total, packed = sum(e.file_size for e in entries), sum(e.compress_size for e in entries)
    if total > MOST_BYTES or (total > LARGE_BYTES and total > MOST_RATIO * packed):
        raise RigError(
            f"{path.name} would unpack from {packed / 1e6:,.1f} to {total / 1e6:,.1f} MB, more than is read here: "
            "zip the mesh with its blendshapes, or the table of weights, alone"
        )
    for entry in entries:
        name, steps = entry.filename, entry.filename.removesuffix("/").split("/")
        if "\\" in entry.orig_filename or ":" in steps[0] or {"", ".", ".."} & set(steps) or len(steps) > DEEPEST + 1:
            raise RigError(f"{path.name} holds {name[:80]!r}, which is no path inside it: zip the rig's folder again")
        if entry.flag_bits & 1:
            raise RigError(f"{path.name} is locked with a password: zip the rig without one")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise RigError(f"{path.name} holds the link {name[:80]!r}: zip the file that it points to")
    if len({entry.filename for entry in entries}) < len(entries):
        raise RigError(f"{path.name} holds two files of one name: zip the rig's folder again")


def find_rig(root: zipfile.Path, is_rig: Callable[[zipfile.Path], bool]) -> zipfile.Path:
    """The one file or folder in the archive that `is_rig`, the nearest to its root."""
    name, level = root.name, [root]
    while level:
        found = [source for source in level if is_rig(source)]
        if len(found) == 1:
            return found[0]
        if found:
            message = " and ".join(source.at for source in found[:3])
            raise RigError(f"{name} holds {len(found)} rigs, {message}: zip one of them alone")
        folders = [source for source in level if source.is_dir()]
        inside = [child for folder in folders for child in folder.iterdir()]
        level = sorted((s for s in inside if not s.name.startswith((".", "__MACOSX"))), key=lambda s: s.at)
    if any(entry.lower().endswith((".target", ".target.gz")) for entry in root.root.namelist()):
        raise RigError(
            f"{name} holds .target files but not the mesh that they move: zip MakeHuman's base.obj with their folder"
        )
    raise RigError(f"{name} holds no rig: zip a folder of OBJ, PLY or CSV files, or a .glb, .gltf, .vrm, .fbx or .npz")
