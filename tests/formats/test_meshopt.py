"""Packed buffers: what was packed comes back, byte for byte, from either version; damaged ones are refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_plan.errors import RigError
from capture_plan.formats.meshopt import GROUP_BITS, UNPACKED, decode, least_bytes, octahedral, quaternion


def pack_group(values: bytes, bits: int) -> bytes:
    """Sixteen values in `bits` each, those that do not fit after them."""
    if bits in (0, 8):
        return values if bits else b""
    full = (1 << bits) - 1
    short = [min(value, full) for value in values]
    per_byte = 8 // bits
    rows = [short[i : i + per_byte] for i in range(0, 16, per_byte)]
    if bits == 1:
        rows = [row[::-1] for row in rows]
    packed = bytes(sum(value << bits * (per_byte - 1 - i) for i, value in enumerate(row)) for row in rows)
    return packed + bytes(value for value in values if value >= full)


def pack_column(values: bytes, widths: tuple[int, ...]) -> bytes:
    """A column of differences, every group in the width that takes least."""
    values += bytes(-len(values) % 16)
    header, body = [], b""
    for start in range(0, len(values), 16):
        group = values[start : start + 16]
        fits = [mode for mode in range(4) if widths[mode] or not any(group)]
        best = min(fits, key=lambda mode: len(pack_group(group, widths[mode])))
        header.append(best)
        body += pack_group(group, widths[best])
    header += [0] * (-len(header) % 4)
    return bytes(a | b << 2 | c << 4 | d << 6 for a, b, c, d in zip(*[iter(header)] * 4, strict=True)) + body


def differences(rows: np.ndarray, channel: int) -> np.ndarray:
    """Four columns of rows as differences from the row before, zero before the first."""
    before = np.concatenate([np.zeros((1, 4), np.uint8), rows[:-1]])
    dtype = ("u1", "<u2", "<u4")[channel & 3]
    new, old = np.ascontiguousarray(rows).view(dtype), np.ascontiguousarray(before).view(dtype)
    if channel & 3 == 2:
        turn = np.uint32(channel >> 4)
        d = new ^ old
        d = (d << turn) | (d >> np.uint32(32 - turn)) if turn else d
    else:
        d = new - old
        d = (d << 1) ^ (0 - (d >> (8 * d.dtype.itemsize - 1))).astype(dtype)
    return np.ascontiguousarray(d).view(np.uint8)


def pack(rows: np.ndarray, version: int = 0, channel: int = 0, control: int = 0) -> bytes:
    n, s = rows.shape
    d = np.concatenate([differences(rows[:, i : i + 4], channel) for i in range(0, s, 4)], axis=1)
    data, size = bytes([0xA0 + version]), min(8192 // s & ~15, 256)
    for start in range(0, n, size):
        block = d[start : start + size]
        data += bytes([control * 0b01010101]) * (s // 4) if version else b""
        for column in block.T:
            if control == 3:
                data += column.tobytes()
            elif control < 2:
                data += pack_column(column.tobytes(), GROUP_BITS[control + 1 if version else 0])
    tail = bytes(s) + (bytes([channel]) * (s // 4) if version else b"")
    return data + bytes(max(0, (24 if version else 32) - len(tail))) + tail


@settings(max_examples=60, deadline=None)
@given(
    n=st.integers(1, 600),
    s=st.sampled_from([4, 8, 12, 64, 256]),
    step=st.sampled_from([0, 1, 5, 200]),
    version=st.integers(0, 1),
    channel=st.sampled_from([0, 1, 2, 2 + 16 * 7]),
    control=st.sampled_from([0, 1, 3]),
    seed=st.integers(0, 99),
)
def test_rows_come_back_as_they_were_packed(n, s, step, version, channel, control, seed):
    steps = np.random.default_rng(seed).integers(-step, step + 1, (n, s))
    rows = (np.cumsum(steps, axis=0) % 256).astype(np.uint8)
    packed = pack(rows, version, channel if version else 0, control if version else 0)
    assert decode(packed, "ATTRIBUTES", "NONE", n, s) == rows.tobytes()
    assert len(packed) >= least_bytes("ATTRIBUTES", n, s)


def test_a_block_of_zeros_needs_a_thousandth_of_its_size_and_no_file_less():
    rows = np.zeros((256 * 40, 8), np.uint8)
    packed = pack(rows, version=1, control=2)
    assert decode(packed, "ATTRIBUTES", "NONE", *rows.shape) == rows.tobytes()
    assert least_bytes("ATTRIBUTES", *rows.shape) <= len(packed) < 2 * least_bytes("ATTRIBUTES", *rows.shape)


def test_the_specification_s_example_of_four_bits_reads_as_it_says():
    """Values 15 are sentinels; the two bytes after the eight packed ones stand for them."""
    codes = b"".join(UNPACKED[4][byte] for byte in bytes.fromhex("175ff0bc77a92100"))
    assert [i for i, code in enumerate(codes) if code == 255] == [3, 4]
    assert [-(code + 1) // 2 if code & 1 else code // 2 for code in codes if code != 255] == [
        -1, -4, -3, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0,
    ]  # fmt: skip


def varint(value: int) -> bytes:
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)


def zigzag(delta: int) -> int:
    return 2 * delta if delta >= 0 else -2 * delta - 1


def pack_triangles(triangles: list[tuple[int, int, int]]) -> bytes:
    """Over the last edges where one is shared, else with all three corners written out."""
    codes, data, last, new, edges, recent = b"", b"", 0, 0, [], []

    def written(index):
        nonlocal last, data
        data, last = data + varint(zigzag(index - last)), index

    for a, b, c in triangles:
        turned = [t for t in ((a, b, c), (b, c, a), (c, a, b)) if t[:2] in edges[-15:]]
        if turned:
            a, b, c = turned[0]
            x = edges[::-1].index((a, b))
            if c == new:
                codes, new = codes + bytes([x << 4]), new + 1
                recent.append(c)
            elif 0 < recent[::-1].index(c) < 13 if c in recent else False:
                codes += bytes([x << 4 | recent[::-1].index(c)])
            else:
                codes += bytes([x << 4 | (13 if c == last - 1 else 14 if c == last + 1 else 15)])
                if c in (last - 1, last + 1):
                    last = c
                else:
                    written(c)
                recent.append(c)
            edges += [(c, b), (a, c)]
        else:
            codes, data = codes + b"\xff", data + b"\xff"
            for index in (a, b, c):
                written(index)
            recent += [a, b, c]
            edges += [(b, a), (c, b), (a, c)]
    return b"\xe1" + codes + data + bytes(16)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(0, 12)] * 3), min_size=1, max_size=60)
    | st.lists(st.tuples(*[st.integers(0, 60_000)] * 3), min_size=1, max_size=20)
)
def test_triangles_come_back_up_to_the_corner_they_start_from(triangles):
    found = np.frombuffer(decode(pack_triangles(triangles), "TRIANGLES", "NONE", 3 * len(triangles), 2), "<u2")
    for triangle, (a, b, c) in zip(triangles, found.reshape(-1, 3).tolist(), strict=True):
        assert triangle in ((a, b, c), (b, c, a), (c, a, b))


def test_a_strip_of_new_vertices_takes_one_byte_a_triangle():
    """0xf0 with a table of zeros makes three new vertices; then each triangle has an edge and the next vertex."""
    packed = bytes([0xE1, 0xF0, 0x10, 0x10]) + bytes(16)
    assert np.frombuffer(decode(packed, "TRIANGLES", "NONE", 9, 4), "<u4").reshape(3, 3).tolist() == [
        [0, 1, 2], [2, 1, 3], [3, 1, 4],
    ]  # fmt: skip


@given(st.lists(st.tuples(st.integers(0, 2**29), st.booleans()), max_size=30))
def test_numbers_come_back_from_either_running_value(numbers):
    last, data = [0, 0], b"\xd1"
    for value, which in numbers:
        data += varint(zigzag(value - last[which]) << 1 | which)
        last[which] = value
    found = np.frombuffer(decode(data + bytes(4), "INDICES", "NONE", len(numbers), 4), "<u4")
    assert found.tolist() == [value for value, _ in numbers]


@pytest.mark.parametrize("dtype", [np.int8, np.int16])
def test_octahedral_rows_are_unit_vectors_in_the_right_octant(dtype):
    most = np.iinfo(dtype).max
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    coded = np.stack([x, y, np.ones_like(x), x], axis=-1).reshape(-1, 4) * most
    found = octahedral(coded.round().astype(dtype))
    np.testing.assert_allclose(np.linalg.norm(found[:, :3] / most, axis=1), 1, atol=0.02)
    np.testing.assert_array_equal(found[:, 3], coded[:, 3].round())
    np.testing.assert_array_equal(octahedral(np.array([[0, 0, most, 0], [most, 0, most, 0]], dtype))[:, :3],
                                  [[0, 0, most], [most, 0, 0]])  # fmt: skip
    corner = octahedral(np.array([[most, most, most, 0]], dtype))[0]
    np.testing.assert_array_equal(corner[:3], [0, 0, -most])


def test_the_left_out_component_of_a_rotation_is_put_where_it_was():
    for largest in range(4):
        coded = np.array([[0, 0, 0, 0x7FFC | largest]], np.int16)
        np.testing.assert_array_equal(quaternion(coded)[0], np.where(np.arange(4) == largest, 32767, 0))


def test_exponents_scale_mantissas():
    words = np.array([[(-2 << 24) | 5, (3 << 24) | (0xFFFFFF & -7)]], np.int64).astype(np.uint32).view(np.uint8)
    found = np.frombuffer(decode(pack(words.reshape(1, 8)), "ATTRIBUTES", "EXPONENTIAL", 1, 8), "<f4")
    np.testing.assert_array_equal(found, [5 / 4, -56])


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=120), st.sampled_from(["ATTRIBUTES", "TRIANGLES", "INDICES"]), st.integers(0, 90))
def test_damaged_streams_are_refused_or_give_as_much_as_was_asked(noise, mode, count):
    count = count // 3 * 3
    for head in (b"", b"\xa0", b"\xa1", b"\xe1", b"\xd1"):
        try:
            found = decode(head + noise, mode, "NONE", count, 4)
        except RigError:
            continue
        assert len(found) == 4 * count


def test_a_stream_cut_anywhere_is_refused():
    rows = np.random.default_rng(0).integers(0, 9, (100, 8)).astype(np.uint8)
    for mode, packed, count, stride in (
        ("ATTRIBUTES", pack(rows), 100, 8),
        ("ATTRIBUTES", pack(rows, 1, 1, 1), 100, 8),
        ("TRIANGLES", pack_triangles([(0, 1, 2), (2, 1, 9), (700, 2, 1)]), 9, 2),
    ):
        for end in range(len(packed)):
            with pytest.raises(RigError, match="damaged"):
                decode(packed[:end], mode, "NONE", count, stride)
