"""Takes inside a zip archive, as apps send them: a table of weights beside films, settings and logs.

Table      the one that names a face in more than one frame; tables before JSON
Several    calibrated and raw, or a neutral beside the take: raw ones and neutrals are left out and named
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from capture_plan.curves.json_weights import known
from capture_plan.curves.unfiltered import RAW
from capture_plan.curves.weights import WeightTable
from capture_plan.errors import RigError
from capture_plan.input.zipped import open_zip
from capture_plan.names.tokens import split_words

FIRST = (".csv", ".tsv", ".txt")
ASIDE = RAW | {"neutral", "calibration"}
Readers = Mapping[str, Callable[[Path], WeightTable]]


def read_zip(path: Path, readers: Readers) -> WeightTable:
    """The take in a zip archive. RigError where it holds none or several."""
    found, faults, count = tables_in(path, readers)
    plain = {name: take for name, take in found.items() if ASIDE.isdisjoint(split_words(PurePosixPath(name).stem))}
    chosen = plain if len(found) > 1 else found
    if not found and len(faults) == 1:
        name, fault = next(iter(faults.items()))
        raise RigError(f"holds {name}, which {fault}")
    if len(chosen) != 1:
        message = f"{len(found)} tables of weights ({', '.join(list(found)[:3])})" if found else "no table of weights"
        raise RigError(f"holds {message}, expected one: unpack it and give one file")
    name, take = next(iter(chosen.items()))
    if count == 1:
        return take
    others = [other for other in found if other != name]
    others_words = f"; {', '.join(others)} beside it {'is' if len(others) == 1 else 'are'} left out" if others else ""
    return replace(take, notes=(f"of the archive, {name} is read{others_words}", *take.notes))


def tables_in(path: Path, readers: Readers) -> tuple[dict[str, WeightTable], dict[str, str], int]:
    """Tables of weights by their names in the archive, what is said of files that hold none, how many files it has."""
    with open_zip(path) as root, TemporaryDirectory() as folder:
        names = [name for name in root.root.namelist() if not name.endswith("/") and not _is_hidden(name)]
        kinds = {name: PurePosixPath(name).suffix.lower() for name in names}
        found: dict[str, WeightTable] = {}
        faults: dict[str, str] = {}
        for some in (FIRST, tuple(set(readers) - set(FIRST))):
            here = [name for name in names if kinds[name] in some]
            for i, name in enumerate(here):
                copy = Path(folder) / f"{i}{kinds[name]}"
                copy.write_bytes((root / name).read_bytes())
                try:
                    take = readers[kinds[name]](copy)
                except RigError as error:
                    faults[name] = str(error)
                    continue
                if len(take.weights) > 1 and any(map(known, take.columns)):
                    found[name] = take
            if found:
                break
        return found, faults, len(names)


def _is_hidden(name: str) -> bool:
    """Whether a file is one that systems leave in archives."""
    return any(step.startswith((".", "__MACOSX")) for step in name.split("/"))
