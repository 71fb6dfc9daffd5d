"""Which axis of an array counts frames, which vertices, which xyz: tools save all orders.

    (t, v, 3)   usual               (t, 3 v)    in a row, x y z of one vertex after the other
    (t, 3, v)   (v, t, 3)   (v, 3, t)   (3 v, t)   (1, t, v, 3)
Counts     how many vertices the mesh has, by the rig, a neutral or the faces: they decide between two orders
"""

from collections.abc import Collection

import numpy as np

FEWEST_VERTICES = 100  # fewer in a row of numbers are weights without names


def as_frames(array: np.ndarray, counts: Collection[int] = ()) -> tuple[np.ndarray, tuple[str, ...]]:
    """A view of the array as (t, v, 3), and a sentence where it had other axes; as it is where it holds no frames."""
    if array.dtype.kind not in "fiu" or array.size == 0:
        return array, ()
    x = array[0] if array.ndim == 4 and len(array) == 1 else array
    turned = in_rows(x, counts) if x.ndim == 2 else by_axes(x, counts) if x.ndim == 3 else x
    if turned.ndim != 3 or turned.shape[2] != 3:
        return array, ()
    if turned.shape == array.shape or (x.ndim == 2 and len(turned) == len(x)):
        return turned, ()
    return turned, (f"its array {array.shape} is taken as {len(turned):,} frames of {turned.shape[1]:,} vertices",)


def in_rows(x: np.ndarray, counts: Collection[int]) -> np.ndarray:
    """Frames of an array of two axes, of which one holds x, y and z of all vertices."""
    long = x.shape[1] % 3 == 0 and x.shape[1] >= 3 * max(FEWEST_VERTICES, *counts)
    known = [n % 3 == 0 and n // 3 in counts for n in x.shape]
    if known[1] or (long and not known[0]):
        return x.reshape(len(x), -1, 3)
    if known[0]:  # nothing else tells the frames of a small mesh from weights without names
        return x.reshape(-1, 3, x.shape[1]).transpose(2, 0, 1)
    return x


def by_axes(x: np.ndarray, counts: Collection[int]) -> np.ndarray:
    """Frames of an array of three axes, of which one holds x, y and z."""
    xyz = next((c for c in (2, 1, 0) if x.shape[c] == 3), None)
    if xyz is None:
        return x
    t, v = (c for c in range(3) if c != xyz)
    if x.shape[t] in counts and x.shape[v] not in counts:
        t, v = v, t
    elif xyz != 2 and x.shape[v] not in counts and x.shape[t] > x.shape[v]:
        t, v = v, t  # where nothing tells the vertices, a face has more of them than a take has frames
    return x.transpose(t, v, xyz)
