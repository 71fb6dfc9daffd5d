"""Cameras of a KRT file, as Multiface has it: a block of text for each.

400002
fx 0 cx            three rows of K, pixels
0 fy cy
0 0 1
k1 k2 p1 p2 k3     one row of the lens; 4 or 5 numbers
r11 r12 r13 t1     three rows of [R t], world to camera, millimetres
...
(an empty line)
"""

import re
from pathlib import Path

import numpy as np

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.fields import distinct, middle_size, numbers, pinhole_lens, placed, words
from capture_plan.errors import RigError

ROWS = (3, 3, 3, 5, 4, 4, 4)
NUMBER = r"[-+]?[\d.]+(?:[eE][-+]?\d+)?"
ROW = re.compile(rf"\s*{NUMBER}(?:\s+{NUMBER}){{2}}\s*")


def is_krt(text: str) -> bool:
    """Whether a text begins like such a block: a name, and three rows of three numbers."""
    lines = [line for line in text[:4000].splitlines() if line.strip()][:4]
    return len(lines) == 4 and not ROW.fullmatch(lines[0]) and all(ROW.fullmatch(line) for line in lines[1:])


def read_multiface(text: str, path: Path) -> Calibration:
    """The cameras of a KRT file."""
    lines = [line for line in text.splitlines() if line.strip()]
    cameras = []
    for start in range(0, len(lines), 1 + len(ROWS)):
        name, *rows = lines[start : start + 1 + len(ROWS)]
        where = f"{path}, {name.strip()[:60]}"
        if len(rows) < len(ROWS):
            raise RigError(f"{where}: has {len(rows)} rows, expected 3 of K, 1 of the lens, 3 of [R t]: copy it again")
        K = np.array([words(row, "K", where, 3) for row in rows[:3]])
        pose = np.array([words(row, "[R t]", where, 4) for row in rows[4:]])
        lens = pinhole_lens(words(rows[3], "the lens", where, 4, 5, 8), where)
        numbers({"K": K}, "K", where, (3, 3))
        cameras.append(placed(name.strip(), K, middle_size(K, where), lens, pose[:, :3], t=pose[:, 3]))
    note = "image sizes are not in the file and are taken as twice the principal point"
    return Calibration("Multiface KRT", distinct(tuple(cameras), str(path)), "millimetres", notes=(note,))
