"""Decoding buffers packed with the meshopt codec: glTF's EXT_meshopt_compression, and KHR_meshopt_compression.

ATTRIBUTES  Every byte of a row (a column) is coded on its own, in blocks of at most 256 rows and groups of 16 rows, as
            differences from the row before. A group takes 0, 1, 2, 4 or 8 bits a row; all bits set mean that the value
            follows as a byte of its own. Version 1 may take differences of 16 bits, or exclusive ors of 32 bits.
TRIANGLES   One byte a triangle says which recent edge and which recent or new vertex make it.
INDICES     One number of variable length for each, the difference from one of two running values.
FILTERS     turn decoded rows into unit vectors (octahedral), rotations (quaternion) or floats (exponential).

Own code, because the published bindings have to be compiled where they are installed. Sizes are checked by who calls.
Source: the extension's specification, appendices A (bitstream) and B (filters), and, for version 1, the reference
decoder in JavaScript of the meshoptimizer project. Letters: n rows, s bytes in a row.
"""

import numpy as np
from jaxtyping import Int, Shaped, UInt8

from capture_plan.errors import RigError

DAMAGED = "has a packed buffer that was cut off or damaged: export it again"
LITERAL = 255  # in a decoded group: the next byte of its own
ZEROS, LITERALS = bytes(16), bytes([LITERAL] * 16)
GROUP_BITS = ((0, 2, 4, 8), (0, 1, 2, 4), (1, 2, 4, 8))  # version 0; version 1 with control 0, with control 1
MOST_ROWS, BLOCK_BYTES = 256, 8192


def _unpacked(bits: int) -> list[bytes]:
    """For each byte, the values that it holds, with all bits set as LITERAL; 1-bit values come lowest first."""
    full, count = (1 << bits) - 1, 8 // bits
    shifts = range(8) if bits == 1 else range(8 - bits, -1, -bits)
    values = [[byte >> shift & full for shift in shifts] for byte in range(256)]
    assert all(len(row) == count for row in values)
    return [bytes(LITERAL if value == full else value for value in row) for row in values]


UNPACKED = {bits: _unpacked(bits) for bits in (1, 2, 4)}


def least_bytes(mode: str, count: int, stride: int) -> int:
    """The fewest bytes into which the codec can pack `count` rows: a file that declares more rows lies."""
    if mode == "ATTRIBUTES":
        return count * stride // 1024  # version 1: one bit pair for each column of 256 rows
    return count // 3 if mode == "TRIANGLES" else count


def decode(source: bytes, mode: str, filtering: str, count: int, stride: int) -> bytes:
    """`count` rows of `stride` bytes. RigError when the source is damaged."""
    try:
        if mode == "ATTRIBUTES":
            return filtered(decode_attributes(source, count, stride), filtering)
        values = decode_triangles(source, count) if mode == "TRIANGLES" else decode_indices(source, count)
    except IndexError as error:
        raise RigError(DAMAGED) from error
    numbers = np.array(values, dtype=np.uint32)
    if stride == 2 and (numbers > np.iinfo(np.uint16).max).any():
        raise RigError(DAMAGED)
    return numbers.astype(f"<u{stride}").tobytes()


def decode_attributes(source: bytes, n: int, s: int) -> UInt8[np.ndarray, "n s"]:
    """Rows of version 0 or 1, before any filter."""
    version = source[0] - 0xA0
    tail = s + (s // 4 if version else 0)
    end = len(source) - max(tail, 24 if version else 32)
    if version not in (0, 1) or end < 1:
        raise RigError(DAMAGED)
    first, channels = source[len(source) - tail :][:s], source[len(source) - tail :][s:] if version else bytes(s // 4)
    at, rows, blocks = 1, min(BLOCK_BYTES // s & ~15, MOST_ROWS), []
    for start in range(0, n, rows):
        block, at = read_block(source, at, end, min(rows, n - start), s, version)
        blocks.append(block)
    if at != end:
        raise RigError(DAMAGED)
    deltas = np.concatenate([np.zeros((s, 0), np.uint8), *blocks], axis=1)
    columns = [
        add_up(deltas[i : i + 4].T, np.frombuffer(first[i : i + 4], np.uint8), channels[i // 4]) for i in range(0, s, 4)
    ]
    return np.concatenate(columns, axis=1)


def read_block(source: bytes, at: int, end: int, n: int, s: int, version: int) -> tuple[UInt8[np.ndarray, "s n"], int]:
    """Differences of one block, column by column, and where the next block starts."""
    groups = -(-n // 16)
    controls, codes, literals = at, bytearray(), bytearray()
    at += s // 4 if version else 0
    for column in range(s):
        control = source[controls + column // 4] >> column % 4 * 2 & 3 if version else 0
        if at > end:
            raise RigError(DAMAGED)
        if control == 2:  # all zero
            codes += ZEROS * groups
        elif control == 3:  # all rows as they are
            codes += LITERALS * (n // 16) + LITERALS[: n % 16] + ZEROS[: -n % 16]
            literals += source[at : at + n]
            at += n
        else:
            at = read_groups(source, at, groups, GROUP_BITS[control + 1 if version else 0], codes, literals)
    values = np.frombuffer(codes, np.uint8).copy()
    places = np.flatnonzero(values == LITERAL)
    if len(places) != len(literals) or len(values) != s * groups * 16:
        raise RigError(DAMAGED)
    values[places] = np.frombuffer(literals, np.uint8)
    return values.reshape(s, groups * 16)[:, :n], at


def read_groups(
    source: bytes, at: int, groups: int, widths: tuple[int, ...], codes: bytearray, literals: bytearray
) -> int:
    """Adds the groups of one column to `codes` and `literals`; where the next column starts."""
    header = at
    at += -(-groups // 4)
    for group in range(groups):
        bits = widths[source[header + group // 4] >> group % 4 * 2 & 3]
        if bits == 0:
            codes += ZEROS
            continue
        if bits == 8:
            code = LITERALS
        else:
            code = b"".join([UNPACKED[bits][byte] for byte in source[at : at + 2 * bits]])
            at += 2 * bits
        count = code.count(LITERAL)
        codes += code
        literals += source[at : at + count]
        at += count
    return at


def add_up(deltas: UInt8[np.ndarray, "n 4"], first: UInt8[np.ndarray, " 4"], channel: int) -> UInt8[np.ndarray, "n 4"]:
    """Four columns from their differences and from the row that stands before the first."""
    kind = channel & 3
    if kind == 3:
        raise RigError(DAMAGED)
    dtype = np.dtype(("u1", "<u2", "<u4")[kind])
    d, start = np.ascontiguousarray(deltas).view(dtype), first.view(dtype)
    if kind == 2:
        turn = np.uint32(channel >> 4)
        d = d if turn == 0 else (d >> turn) | (d << np.uint32(32 - turn))
        rows = np.bitwise_xor.accumulate(np.concatenate([start[None], d]), axis=0)[1:]
    else:
        rows = np.cumsum(zigzag(d), axis=0, dtype=dtype) + start
    return np.ascontiguousarray(rows).view(np.uint8)


def zigzag(v: Shaped[np.ndarray, "*any"]) -> Shaped[np.ndarray, "*any"]:
    """0, 1, 2, 3 ... -> 0, -1, 1, -2 ..., in unsigned arithmetic that wraps around."""
    return (v >> 1) ^ (~(v & 1) + 1).astype(v.dtype)


def decode_triangles(source: bytes, count: int) -> list[int]:
    """Corners of `count` / 3 triangles (appendix A, mode 1)."""
    if source[0] != 0xE1 or len(source) < 17 + count // 3:
        raise RigError(DAMAGED)
    table, data = source[-16:], Numbers(source, 1 + count // 3, len(source) - 16)
    corners, edges, recent, new = [], [], [], 0
    for code in source[1 : 1 + count // 3]:
        x, y = code >> 4, code & 15
        if x < 15:
            a, b = edges[-1 - x]
            if y == 0:
                c, new = new, new + 1
            elif y < 13:
                c = recent[-1 - y]
            else:
                c = data.step(-1) if y == 13 else data.step(1) if y == 14 else data.index()
            if y == 0 or y >= 13:
                recent.append(c)
            edges += [(c, b), (a, c)]
        else:
            packed = table[y] if y < 14 else data.byte()
            if y >= 14 and packed == 0:
                new = 0
            triangle = []
            for nibble in (0 if y < 15 else 15, packed >> 4, packed & 15):
                if nibble == 0:
                    triangle.append(new)
                    new += 1
                else:
                    triangle.append(data.index() if nibble == 15 else recent[-nibble])
            a, b, c = triangle
            recent.append(a)
            recent += [b] if packed >> 4 in (0, 15) else []
            recent += [c] if packed & 15 in (0, 15) else []
            edges += [(b, a), (c, b), (a, c)]
        corners += [a, b, c]
    if data.at != data.end:
        raise RigError(DAMAGED)
    return corners


def decode_indices(source: bytes, count: int) -> list[int]:
    """Numbers of any other kind (appendix A, mode 2)."""
    if source[0] != 0xD1:
        raise RigError(DAMAGED)
    data, last, values = Numbers(source, 1, len(source) - 4), [0, 0], []
    for _ in range(count):
        number = data.varint()
        last[number & 1] = (last[number & 1] + signed(number >> 1)) & 0xFFFFFFFF
        values.append(last[number & 1])
    if data.at != data.end:
        raise RigError(DAMAGED)
    return values


def signed(v: int) -> int:
    """0, 1, 2, 3 ... -> 0, -1, 1, -2 ..."""
    return ~(v >> 1) if v & 1 else v >> 1


class Numbers:
    """The numbers that follow the codes, and the last index that was written out."""

    def __init__(self, source: bytes, at: int, end: int) -> None:
        self.source, self.at, self.end, self.last = source, at, end, 0

    def byte(self) -> int:
        """The next byte. RigError where there is none."""
        if self.at >= self.end:
            raise RigError(DAMAGED)
        self.at += 1
        return self.source[self.at - 1]

    def varint(self) -> int:
        """An unsigned number of 32 bits, seven to a byte, the lowest first."""
        value = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value & 0xFFFFFFFF
        raise RigError(DAMAGED)

    def step(self, by: int) -> int:
        """The last number moved on by `by`, as an unsigned number of 32 bits."""
        self.last = (self.last + by) & 0xFFFFFFFF
        return self.last

    def index(self) -> int:
        """The next vertex number, coded as its difference to the last."""
        return self.step(signed(self.varint()))


def filtered(rows: UInt8[np.ndarray, "n s"], filtering: str) -> bytes:
    """The rows after one of the filters of appendix B."""
    rows, s = np.ascontiguousarray(rows), rows.shape[1]
    if filtering == "NONE":
        return rows.tobytes()
    if filtering == "OCTAHEDRAL" and s in (4, 8):
        return octahedral(rows.view(f"<i{s // 4}")).tobytes()
    if filtering == "QUATERNION" and s == 8:
        return quaternion(rows.view("<i2")).tobytes()
    if filtering == "EXPONENTIAL":
        v = rows.view("<i4")
        with np.errstate(over="ignore"):
            return np.ldexp((v << 8 >> 8).astype(np.float32), v >> 24).astype("<f4").tobytes()
    raise RigError(f"has a buffer packed with the filter {filtering!r} in rows of {s} bytes, which is not read here")


def octahedral(v: Int[np.ndarray, "n 4"]) -> Int[np.ndarray, "n 4"]:
    """Unit vectors from their two coordinates on the octahedron; the fourth number is passed through."""
    most = np.iinfo(v.dtype).max
    one = np.maximum(v[:, 2], 1).astype(np.float64)
    x, y = v[:, 0] / one, v[:, 1] / one
    z = 1 - np.abs(x) - np.abs(y)
    t = np.maximum(-z, 0)
    xyz = np.stack([x - np.copysign(t, x), y - np.copysign(t, y), z], axis=1)
    xyz *= most / np.linalg.norm(xyz, axis=1, keepdims=True)
    return np.concatenate([np.rint(xyz).astype(v.dtype), v[:, 3:]], axis=1)


def quaternion(v: Int[np.ndarray, "n 4"]) -> Int[np.ndarray, "n 4"]:
    """Unit quaternions from three components; the lowest two bits of the fourth say which one was left out."""
    scale = np.sqrt(0.5) / (v[:, 3] | 3)
    xyz = v[:, :3] * scale[:, None]
    w = np.sqrt(np.maximum(1 - (xyz**2).sum(axis=1), 0))
    out = np.empty_like(v)
    for step, part in enumerate((w, *xyz.T)):
        np.put_along_axis(out, (v[:, 3:] & 3) + step & 3, np.rint(part * 32767).astype("<i2")[:, None], axis=1)
    return out
