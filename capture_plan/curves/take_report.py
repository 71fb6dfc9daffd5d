"""What was understood of a take, in lines for a person to read, of at most `WIDE` letters.

take: 335 frames, 30 in a second, 11.2 s
  note: 6 of 341 frames have no face and were left out
  52 columns drive 52 of the rig's 52 blendshapes
  of the same name (16):
    browInnerUp       cheekPuff         jawOpen           jawForward        jawLeft
  means the same (36):
    browDown_L -> browDownLeft            browDown_R -> browDownRight
  2 columns drive nothing:
    Timecode, BlendshapeCount: they are no weights
  no column drives 3 of the rig's blendshapes:
    tongueOut, mouthRollUpper, mouthRollLower
"""

import re
import textwrap
from collections.abc import Sequence

from capture_plan.curves.columns import plain
from capture_plan.curves.mapping import HOW, WeightMapping
from capture_plan.prose import count

WIDE = 100
GAP = 2  # spaces between columns of names
MANY = (
    (r"^it is no weight", "they are no weights"),
    (r"^it is\b", "they are"),
    (r"^it has\b", "they have"),
    (r"^it (\w+?)s\b", r"they \1"),
    (r"^its name says\b", "their names say"),
    (r"\bfor it\b", "for them"),
)  # what is said of one column, said of several
SECONDS = 120


def length(frames: int, fps: float) -> str:
    """'3,046 frames, 60 in a second, 50.8 s'."""
    seconds = frames / fps
    lasts = f"{seconds:.3g} s" if seconds < SECONDS else f"{seconds // 60:.0f} min {seconds % 60:.0f} s"
    return f"{count(frames, 'frame')}, {fps:g} in a second, {lasts}"


def mapped(mapping: WeightMapping) -> list[str]:
    """Which columns drive which blendshapes, which drive nothing, and what nothing drives."""
    driven = {one.blendshape for one in mapping.drives if one.share}
    every = len(driven) + len(mapping.idle)
    verb = "drives" if len(mapping.columns) == 1 else "drive"
    lines = [f"{count(len(mapping.columns), 'column')} {verb} {len(driven)} of the rig's {count(every, 'blendshape')}"]
    alike = [one.column for one in mapping.drives if plain(one.column) == plain(one.blendshape)]
    if alike:
        lines += [f"of the same name ({len(alike)}):", *grid(alike)]
    for how in HOW:
        targets: dict[str, list[str]] = {}
        for one in mapping.drives:
            if one.how == how and one.column not in alike:
                targets.setdefault(one.column, []).append(one.blendshape)
        if targets:
            pairs = [f"{column} -> {', '.join(names)}" for column, names in targets.items()]
            lines += [f"{how} ({len(pairs)}):", *grid(pairs)]
    return [*lines, *_left_out(mapping), *idle(mapping)]


def _left_out(mapping: WeightMapping) -> list[str]:
    """Columns that drive nothing, by the reason."""
    if not mapping.left_out:
        return []
    verb = "drives" if len(mapping.left_out) == 1 else "drive"
    lines = [f"{count(len(mapping.left_out), 'column')} {verb} nothing:"]
    for why in dict.fromkeys(why for _, why in mapping.left_out):
        columns = [column for column, reason in mapping.left_out if reason == why]
        lines += fold(f"{', '.join(columns)}: {of_several(why) if len(columns) > 1 else why}")
    return lines


def idle(mapping: WeightMapping) -> list[str]:
    """Blendshapes of the rig that no column drives."""
    if not mapping.idle:
        return []
    return [
        f"no column drives {len(mapping.idle)} of the rig's blendshapes:",
        *fold(", ".join(mapping.idle), then="  "),
    ]


def of_several(why: str) -> str:
    """A reason of one column as one of several."""
    for one, many in MANY:
        why = re.sub(one, many, why, count=1)
    return why


def grid(names: Sequence[str]) -> list[str]:
    """Names in aligned columns, row after row."""
    wide = max(map(len, names)) + GAP
    each = max(1, (WIDE - 4) // wide)
    rows = ["".join(f"{name:<{wide}}" for name in names[i : i + each]).rstrip() for i in range(0, len(names), each)]
    return [line for row in rows for line in (fold(row) if len(row) > WIDE - 4 else [f"  {row}"])]


def fold(text: str, first: str = "  ", then: str = "    ") -> list[str]:
    """A text in lines that are not too long, the first after `first`, the others after `then`."""
    return textwrap.wrap(
        text, WIDE - 2, initial_indent=first, subsequent_indent=then, break_long_words=False, break_on_hyphens=False
    )
