"""FBX as a tree of named nodes, from its binary (version 7100 and newer) and its ASCII form.

Node     name, values, children: `Vertices: *6 { a: 0,0,0,1,0,0 }` is the node Vertices with one value, an array
Array    stays packed (compressed bytes, or text) until it is asked for; what it declares is checked before that
Binary   record = end offset, number of values, their bytes, name, values, children, an empty record; the three numbers
         have 32 bits, from version 7500 on 64 (as described by Blender's documentation of the format)

Object names read "Class::name" in both forms, which is how ASCII writes them. Errors do not yet name the file.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from capture_plan.errors import RigError
from capture_plan.input.bounds import MOST_NODES, MOST_TAKE_BYTES

MAGIC = b"Kaydara FBX Binary  \0"
OLDEST = 7100  # of binary and ASCII alike; before, a mesh was part of its node and objects were linked by name
DEEPEST = 64  # levels of nodes; real files have about 8
WIDE = 7500  # first version with 64-bit record headers
ROOM = 2**28  # bytes that all arrays of a small file may take: 256 MB
UNPACKS_TO = 64  # and for each byte of the file so many more; zlib reaches 1,032 on nothing but zeros
ARRAYS = {b"f": "<f4", b"d": "<f8", b"i": "<i4", b"l": "<i8", b"b": "|i1", b"c": "|i1"}
SCALARS = {b"Y": "<h", b"C": "<b", b"B": "<b", b"Z": "<b", b"I": "<i", b"F": "<f", b"D": "<d", b"L": "<q"}
TOKEN = re.compile(
    rb"""(?: "(?P<string>[^"]*+)"
      | \*(?P<count>\d++)\s*+\{\s*+a:(?P<array>[^{}]*+)\}
      | (?P<name>[A-Za-z_][\w|.-]*+):
      | (?P<brace>[{}])
      | (?P<word>[^\s,{}"]++) )
    (?: \s++ | , | ;[^\n]*+ )*+  # spaces, commas and comments lie between tokens""",
    re.VERBOSE,
)
SPACE = re.compile(rb"(?:\s++|;[^\n]*+)*+")
NUMBERS = re.compile(rb"[\s0-9,.eE+-]*+")


@dataclass(frozen=True, eq=False, slots=True)
class Packed:
    """An array of `count` numbers, still as the file has it: text when `dtype` is empty, else bytes."""

    count: int
    dtype: str
    data: memoryview
    compressed: bool = False

    @property
    def size(self) -> int:
        """Bytes that it unpacks to."""
        return self.count * (np.dtype(self.dtype).itemsize if self.dtype else 8)

    def unpack(self) -> np.ndarray:
        """The numbers in a row (count,). RigError unless there are as many as declared."""
        if self.count == 0:
            return np.zeros(0)
        values = self.parse() if not self.dtype else np.frombuffer(self.inflate(), self.dtype)
        if len(values) != self.count:
            raise RigError(
                f"was cut off: an array has {len(values):,} numbers, expected {self.count:,}: export it again"
            )
        return values

    def parse(self) -> np.ndarray:
        """Numbers of text, no more than declared."""
        if not NUMBERS.fullmatch(self.data) or bytes(self.data).count(b",") > self.count:
            raise RigError("has an array that is not a list of as many numbers as it says: export it again")
        return np.array([float(number) for number in bytes(self.data).split(b",") if number.strip()])

    def inflate(self) -> bytes | memoryview:
        """The bytes of the numbers, whatever the file holds no more than declared."""
        if not self.compressed:
            return self.data
        return zlib.decompressobj().decompress(self.data, self.size)


Value = int | float | str | Packed


@dataclass(frozen=True, eq=False, slots=True)
class Node:
    """A node of the file's tree."""

    name: str
    values: tuple[Value, ...]
    children: tuple["Node", ...]

    def all(self, name: str) -> Iterator["Node"]:
        """Every child of this name, in the file's order."""
        return (child for child in self.children if child.name == name)

    def child(self, name: str) -> "Node":
        """The first child of this name, or an empty node."""
        return next(self.all(name), Node(name, (), ()))

    def array(self) -> np.ndarray:
        """The node's numbers in a row: of its array, or its plain values; none without any."""
        if self.values and isinstance(self.values[0], Packed):
            return self.values[0].unpack()
        return np.array([float(value) for value in self.values if isinstance(value, int | float)])


def read_tree(data: bytes) -> Node:
    """The root of the file's tree, whose children are its sections (Objects, Connections, ...)."""
    root = _read_binary(data) if data.startswith(MAGIC) else read_ascii(data)
    declared = sum(_sizes(root))
    if declared > ROOM + UNPACKS_TO * len(data):
        raise RigError(f"declares {declared:,} bytes of numbers but has only {len(data):,} bytes: export it again")
    return root


def _sizes(node: Node) -> Iterator[int]:
    """Bytes that each array in the tree unpacks to."""
    yield from (value.size for value in node.values if isinstance(value, Packed))
    for child in node.children:
        yield from _sizes(child)


def check_version(version: int) -> None:
    """RigError unless the version is one whose files are built like today's."""
    if version < OLDEST:
        raise RigError(f"is FBX version {version}, expected {OLDEST} or newer: export it as FBX 2014 or newer")


def check_depth(depth: int) -> None:
    """RigError when nodes lie too deep in one another."""
    if depth > DEEPEST:
        raise RigError(f"has nodes more than {DEEPEST} levels deep, expected about 8: export it again")


@dataclass
class Tally:
    """How many nodes and values a file was found to hold."""

    count: int = 0

    def add(self, more: int) -> None:
        """Count more of them. RigError when they are more than any scene has."""
        self.count += more
        if self.count > MOST_NODES:
            message = f"has more than {MOST_NODES:,} nodes and values"
            raise RigError(f"{message}: export the head alone, without its animation")


def _read_binary(data: bytes) -> Node:
    """The tree of a binary file."""
    (version,) = struct.unpack_from("<I", data, 23)
    check_version(version)
    header = struct.Struct("<QQQB" if version >= WIDE else "<IIIB")
    view, start, sections, tally = memoryview(data), 27, [], Tally()
    while True:
        node, start = read_record(view, start, len(data), header, 1, tally)
        if node is None:
            return Node("", (), tuple(sections))
        sections.append(node)


def read_record(
    view: memoryview, start: int, limit: int, header: struct.Struct, depth: int, tally: Tally
) -> tuple[Node | None, int]:
    """The record at `start`, None for the empty one, and where the next begins; none reaches beyond `limit`."""
    check_depth(depth)
    if start + header.size > limit:
        raise RigError(f"was cut off at byte {limit:,}: copy or export it again")
    end, count, size, length = header.unpack_from(view, start)
    inner = start + header.size
    if end == 0:
        return None, inner
    tally.add(1 + count)
    values = inner + length
    children = values + size
    if not children <= end <= limit:
        raise RigError(
            f"was cut off: a record ends at byte {max(end, children):,} of {limit:,}: copy or export it again"
        )
    name = bytes(view[inner:values]).decode("ascii", "replace")
    node_values = tuple(read_values(view[values:children], count))
    nodes, at = [], children
    while at < end:
        node, at = read_record(view, at, end, header, depth + 1, tally)
        if node is None:
            break
        nodes.append(node)
    return Node(name, node_values, tuple(nodes)), end


def read_values(view: memoryview, count: int) -> Iterator[Value]:
    """The `count` values of a record, which fill `view`."""
    at = 0
    for _ in range(count):
        code, at = bytes(view[at : at + 1]), at + 1
        if code in SCALARS:
            (value,) = struct.unpack_from(SCALARS[code], view, at)
            yield value
            at += struct.calcsize(SCALARS[code])
        elif code in (b"S", b"R"):
            (length,) = struct.unpack_from("<I", view, at)
            yield text(bytes(view[at + 4 : at + 4 + length])) if code == b"S" else ""
            at += 4 + length
        elif code in ARRAYS:
            length, encoding, size = struct.unpack_from("<III", view, at)
            packed = view[at + 12 : at + 12 + size]
            if encoding == 0:
                packed = view[at + 12 : at + 12 + length * np.dtype(ARRAYS[code]).itemsize]
            yield Packed(length, ARRAYS[code], packed, encoding == 1)
            at += 12 + len(packed)
        else:
            raise RigError(f"has a value of unknown type {code!r}: export it again")
        if at > len(view):
            raise RigError("was cut off inside a value: copy or export it again")


def text(data: bytes) -> str:
    """A string; what binary files call "name NUL SOH class" is "class::name"."""
    name, mark, kind = data.partition(b"\0\x01")
    return (kind + b"::" + name if mark else data).decode("utf-8", "replace")


def read_ascii(data: bytes) -> Node:
    """The tree of an ASCII file."""
    if b"FBX" not in data[:1024]:
        raise RigError("is not FBX: export it again")
    if len(data) > MOST_TAKE_BYTES:
        raise RigError(f"has {len(data) / 1e6:,.0f} MB of text, more than is read: export it as binary FBX")
    root = Node("", (), parse_nodes(tokens(data), 0))
    versions = root.child("FBXHeaderExtension").child("FBXVersion").values
    check_version(versions[0] if versions and isinstance(versions[0], int) else 0)
    return root


def tokens(data: bytes) -> Iterator[re.Match[bytes]]:
    """What the text consists of, one after another. RigError where it makes no sense."""
    at, tally = SPACE.match(data).end(), Tally()  # pyright: ignore[reportOptionalMemberAccess]
    while at < len(data):
        tally.add(1)
        match = TOKEN.match(data, at)
        if match is None:
            raise RigError(f"cannot be read from byte {at:,} on: it was cut off or is damaged: export it again")
        yield match
        at = match.end()


def parse_nodes(matches: Iterator[re.Match[bytes]], depth: int) -> tuple[Node, ...]:
    """The nodes up to the brace that closes them, or at depth 0 up to the end."""
    check_depth(depth)
    nodes: list[Node] = []
    name: str | None = None  # of the node whose values are being read
    values: list[Value] = []
    for match in matches:
        brace = match["brace"]
        if name is None and (brace == b"{" or match.lastgroup in ("string", "array", "word")):
            raise RigError(f"has at byte {match.start():,} what belongs to no node: export it again")
        if name is not None and (brace or match["name"]):
            nodes.append(Node(name, tuple(values), parse_nodes(matches, depth + 1) if brace == b"{" else ()))
            name = None
        if brace == b"}":
            if depth == 0:
                raise RigError(f"has a closing brace too many at byte {match.start():,}: export it again")
            return tuple(nodes)
        if match["name"]:
            name, values = match["name"].decode("ascii"), []
        elif not brace:
            values.append(ascii_value(match))
    if depth:
        raise RigError("was cut off: a brace is never closed: copy or export it again")
    return (*nodes, Node(name, tuple(values), ())) if name is not None else tuple(nodes)


def ascii_value(match: re.Match[bytes]) -> Value:
    """The value that a token stands for."""
    if match["count"] is not None:
        return Packed(int(match["count"][:18]), "", memoryview(match["array"]))
    if match["string"] is not None:
        return match["string"].decode("utf-8", "replace").replace("&quot;", '"')
    word = match["word"].decode("utf-8", "replace")
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word
