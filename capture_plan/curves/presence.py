"""Which rows of a take hold the face that is read: what the tracker says of it, and whose face it is.

Tracked   a cell of a column such as `success` or `trackingState`: a number above 0 or a word such as "normal" says that
          there is a face; 0, -1, "no", "lost", "limited" that there is none. Of `lost` the numbers mean the opposite
Empty     cells say what the others of the column leave to say: no face beside words that find one
Face      a column such as `faceId` or `subject`: of several faces that come in turn the one with the most rows
          is the take; numbers that follow each other are one face, found again
A word that is not known leaves its row in, which is said; so does a column that finds no face in any row.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool

from capture_plan.curves.streams import together
from capture_plan.errors import RigError

NO = frozenset(("false", "no", "n", "f", "off"))
YES = frozenset(("true", "yes", "y", "t", "on"))
GONE = frozenset(
    (
        *("lost", "none", "null", "nan", "n/a", "na", "-", "limited", "missing", "absent", "invisible", "hidden"),
        *("nottracking", "nottracked", "untracked", "notdetected", "undetected", "notfound", "notvisible", "notvalid"),
        *("notavailable", "unavailable", "invalid", "bad", "poor", "fail", "failed", "failure", "error", "inactive"),
        *("noface", "nofacedetected", "trackinglost", "losttracking", "facelost", "lostface", "searching", "stopped"),
        *("initializing", "initialising", "occluded", "outofframe", "notok", "ko", "unsuccessful", "empty", "paused"),
    )
)
THERE = frozenset(
    (
        *("normal", "tracking", "tracked", "track", "ok", "okay", "good", "fine", "valid", "visible", "present"),
        *("success", "successful", "detected", "found", "face", "facedetected", "facefound", "active", "available"),
        *("running", "locked", "full", "fulltracking", "istracked", "istracking", "excellent", "high"),
    )
)
FEW = 4  # faces or takes named in a sentence


def without_face(name: str, cells: Sequence[str], *, opposite: bool = False) -> tuple[Bool[np.ndarray, " t"], str]:
    """Rows of which a column says that they have no face, and what has to be said of the column.

    `opposite`: its numbers and truth values tell that the face is lost.
    """
    answers = {cell: answer(cell, opposite) for cell in set(cells)}
    known = {said for said in answers.values() if said is not None}
    for cell in answers:
        if not cell.strip():
            answers[cell] = None if len(known) == 2 else not next(iter(known), False)
    lost = np.array([answers[cell] is False for cell in cells], dtype=bool)
    unknown = [cell for cell in cells if answers[cell] is None]
    if len(unknown) == len(cells) and len(answers) == 1:
        return lost, ""
    if lost.all():
        return ~lost, f"'{name}' says of every row that no face was tracked: it is not believed"
    if unknown:
        words = ", ".join(f"'{cell.strip()}'" for cell in list(dict.fromkeys(unknown))[:FEW])
        return lost, f"whether a face was tracked is not known where '{name}' says {words}: {len(unknown):,} rows stay"
    return lost, ""


def answer(cell: str, opposite: bool = False) -> bool | None:
    """Whether a cell says that there is a face; None where it does not tell."""
    text = cell.strip().strip("\"'").strip().lower()
    word = "".join(letter for letter in text if letter.isalnum() or letter in "/-")
    word = word.replace("-", "") if len(word) > 1 else word
    if text in NO or text in YES:
        return (text in YES) != opposite
    if text in GONE or word in GONE:
        return False
    if word in THERE:
        return True
    try:
        return (float(text.replace(",", ".")) > 0) != opposite
    except ValueError:
        return None


def other_faces(
    name: str, cells: Sequence[str], times: Sequence[str] = (), *, what: str = "faces"
) -> tuple[Bool[np.ndarray, " t"], str]:
    """Rows of other faces than the one with the most rows, and a sentence that says so; rows without a face stay.

    Numbers that follow each other are those of one face that is found again. `what` are "faces", or "devices", of which
    several one after the other are of one face too.
    """
    faces = [face_of(cell) for cell in cells]
    counts = Counter(face for face in faces if face)
    none = np.zeros(len(cells), dtype=bool)
    if len(counts) < 2 or len(counts) > max(2, len(cells) // 2):  # one face, or a number of its own for every row
        return none, ""
    listed = ", ".join(f"'{face}' {n:,}" for face, n in counts.most_common(FEW))
    more = f" and {len(counts) - FEW:,} more" if len(counts) > FEW else ""
    numbered = all(any(map(str.isdigit, face)) for face in counts)
    if (numbered or what == "devices") and not together(faces, times):
        message = f"'{name}' changes ({listed}{more}), but never are two there at one time: they are taken as one face"
        return none, f"{message}, found again; if they are several people, save each as a file of its own"
    mine, most = counts.most_common(1)[0]
    tie = ", the first of those with the most rows," if list(counts.values()).count(most) > 1 else ""
    message = f"it holds {len(counts):,} {what} by '{name}' (rows: {listed}{more}): only '{mine}'{tie} is read"
    return np.array([bool(face) and face != mine for face in faces]), message


def refuse_takes(name: str, cells: Sequence[str]) -> None:
    """RigError that names the takes where a column tells of several: they are never joined in silence."""
    takes = Counter(cell.strip().strip('"').strip() for cell in cells)
    del takes[""]
    if len(takes) < 2 or len(takes) > max(2, len(cells) // 2):  # one take, or a number of its own for every row
        return
    some = ", ".join(f"'{take}' {n:,}" for take, n in takes.most_common(FEW))
    more = f" and {len(takes) - FEW:,} more" if len(takes) > FEW else ""
    raise RigError(
        f"holds {len(takes):,} takes by '{name}' (rows: {some}{more}): save each as a file of its own, and give one"
    )


def face_of(cell: str) -> str:
    """The face that a cell names, a number without its decimals; nothing where it names none."""
    text = cell.strip().strip('"').strip()
    try:
        number = float(text)
    except ValueError:
        return "" if text.lower() in GONE else text
    return f"{number:g}" if number >= 0 else ""
