"""A glTF 2.0 file as arrays: the container (.glb, or .gltf with buffers inside or beside it), its views and accessors.

Every size that a file declares is held against the bytes that are there, or against MOST_BYTES, before an array of
that size is made; buffers are read from the file's own folder and nowhere else. Packed views (EXT_meshopt_compression)
are unpacked when an accessor first asks for them, meshes in Draco compression as soon as the file is loaded.
Own code of JSON and NumPy, because trimesh drops morph targets and pygltflib leaves accessors, sparse ones too, undone.

Errors carry no file name: who reads the file puts it in front. Sections are those of the glTF 2.0 specification.
"""

import base64
import json
import struct
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import unquote

import numpy as np

from capture_plan.errors import RigError
from capture_plan.formats import draco, meshopt
from capture_plan.input.bounds import check_values, content
from capture_plan.input.source import Source, sibling

COMPONENT = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # 3.6.2.2
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
PACKINGS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
KNOWN = ("KHR_mesh_quantization", draco.NAME, *PACKINGS)  # the ones that change geometry
HARMLESS = (
    *("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_animation_", "KHR_xmp"),
    *("KHR_node_visibility", "VRM", "MSFT_texture_"),
)
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
MOST_BYTES = 1 << 30  # of one array, and of all packed views together
MOST_TORN = 8  # packed views that are tried in vain: each may take as long as a whole one
AGAIN = "export it again"


@dataclass(frozen=True, eq=False)
class Gltf:
    """The document and the bytes of its buffers.

    `unpacked` holds the packed views that were asked for, `decoded` the values of accessors that Draco compressed,
    `torn` what was wrong with packed views that cannot be unpacked, so that none is tried twice.
    """

    document: dict[str, Any]
    buffers: tuple[bytes, ...]
    unpacked: dict[int, bytes] = field(default_factory=dict)
    decoded: dict[int, np.ndarray] = field(default_factory=dict)
    torn: dict[int, str] = field(default_factory=dict)

    def entry(self, key: str, index: object) -> dict[str, Any]:
        """Entry `index` of the document's list `key`."""
        entries = self.document.get(key, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise RigError(f"refers to number {str(index)[:40]} of {len(entries)} {key}: {AGAIN}")
        return entries[index]

    def accessor(self, index: object) -> np.ndarray:
        """Values (count width), normalised integers as -1..1, sparse substitutions made (3.6.2)."""
        a = self.entry("accessors", index)
        dtype, (count, width) = self.dtype(a), self.shape(index)
        if index in self.decoded:
            values = self.decoded[index]  # pyright: ignore[reportArgumentType]
        elif "bufferView" in a:
            values = self.rows(a, dtype, count, width)
        elif count * width * dtype.itemsize > MOST_BYTES:
            raise RigError(f"declares {count:,} values that it does not hold: {AGAIN}")
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in a:
            s = a["sparse"]
            places = self.rows(
                s["indices"], np.dtype(COMPONENT[s["indices"]["componentType"]]), whole_number(s, "count"), 1
            )
            if len(places) and places.max() >= count:
                raise RigError(f"changes value {places.max():,} of {count:,}: {AGAIN}")
            values = values.copy()
            values[places[:, 0]] = self.rows(s["values"], dtype, len(places), width)
        if a.get("normalized") and dtype.kind != "f":
            return np.maximum(values / np.float32(np.iinfo(dtype).max), -1)
        return values

    def shape(self, index: object) -> tuple[int, int]:
        """How many rows of how many numbers an accessor declares."""
        a = self.entry("accessors", index)
        return whole_number(a, "count"), WIDTH[a["type"]]

    @staticmethod
    def dtype(accessor: dict[str, Any]) -> np.dtype:
        """The type of an accessor's numbers (3.6.2.2)."""
        return np.dtype(COMPONENT[accessor["componentType"]])

    def rows(self, place: dict[str, Any], dtype: np.dtype, count: int, width: int) -> np.ndarray:
        """`count` rows of the buffer view that `place` names, which may be spaced by `byteStride`; not a copy."""
        view = self.entry("bufferViews", place["bufferView"])
        data, start, row = self.view(place["bufferView"]), whole_number(place, "byteOffset", 0), dtype.itemsize * width
        packing = packing_of(view)
        default = whole_number(packing, "byteStride") if packing and packing.get("mode") == "ATTRIBUTES" else row
        stride = whole_number(view, "byteStride", default)
        if stride < row:
            raise RigError(f"has rows of {row} bytes that are {stride} bytes apart: {AGAIN}")
        needed = start + (count - 1) * stride + row
        if count == 0:
            return np.zeros((0, width), dtype)
        if needed > len(data):
            raise RigError(f"was cut off: a buffer view has {len(data):,} bytes, expected {needed:,}: {AGAIN}")
        return np.ndarray((count, width), dtype, data, start, (stride, dtype.itemsize))

    def view(self, index: int) -> bytes | memoryview:
        """The bytes of a buffer view, unpacked."""
        view = self.entry("bufferViews", index)
        packing = packing_of(view)
        if packing is None:
            return self.span(view)
        if index in self.torn:
            raise RigError(self.torn[index])
        if len(self.torn) >= MOST_TORN:
            raise RigError(f"has {MOST_TORN} packed buffers that cannot be unpacked: {AGAIN}")
        if index not in self.unpacked:
            try:
                self.unpacked[index] = self.unpack(packing, whole_number(view, "byteLength"))
            except RigError as error:
                self.torn[index] = str(error)
                raise
        return self.unpacked[index]

    def unpack(self, packing: dict[str, Any], length: int) -> bytes:
        """What a packed view of `length` bytes holds, when its declared size can be true."""
        source, mode, filtering = bytes(self.span(packing)), packing["mode"], packing.get("filter", "NONE")
        count, stride = whole_number(packing, "count"), whole_number(packing, "byteStride")
        fits = stride % 4 == 0 and 0 < stride <= 256 if mode == "ATTRIBUTES" else stride in (2, 4)
        if (
            mode not in ("ATTRIBUTES", "TRIANGLES", "INDICES")
            or not fits
            or (mode == "TRIANGLES" and count % 3)
            or (count * stride != length)
        ):
            message = f"{count:,} rows of {stride} bytes, {length:,} in all"
            raise RigError(f"has a packed buffer of {message}, which cannot be: {AGAIN}")
        total = count * stride + sum(map(len, self.unpacked.values()))
        if total > MOST_BYTES or len(source) < meshopt.least_bytes(mode, count, stride):
            raise RigError(f"declares {count * stride:,} bytes packed into {len(source):,}, which cannot be: {AGAIN}")
        return meshopt.decode(source, mode, filtering, count, stride)

    def span(self, place: dict[str, Any]) -> memoryview:
        """`byteLength` bytes of a buffer."""
        number = place["buffer"]
        if not isinstance(number, int) or not 0 <= number < len(self.buffers):
            raise RigError(f"refers to buffer {str(number)[:40]} of {len(self.buffers)}: {AGAIN}")
        start, buffer = whole_number(place, "byteOffset", 0), memoryview(self.buffers[number])
        end = start + whole_number(place, "byteLength")
        if end > len(buffer):
            raise RigError(f"was cut off: a buffer has {len(buffer):,} bytes, expected {end:,}: {AGAIN}")
        return buffer[start:end]


def whole_number(table: dict[str, Any], key: str, default: int | None = None) -> int:
    """The whole number that a table holds under `key`."""
    value = table[key] if default is None else table.get(key, default)
    if type(value) is not int or value < 0:
        raise RigError(f"says that {key} is {str(value)[:40]}, expected a whole number from 0: {AGAIN}")
    return value


def packing_of(view: dict[str, Any]) -> dict[str, Any] | None:
    """How a buffer view is packed, if it is."""
    extensions = view.get("extensions", {})
    return next((extensions[name] for name in PACKINGS if name in extensions), None)


def load_gltf(path: Source) -> Gltf:
    """Document and buffers of a `.glb` or `.gltf` (4.4)."""
    data = content(path)
    chunks = glb_chunks(data) if data[:4] == b"glTF" else {JSON_CHUNK: data}
    if JSON_CHUNK not in chunks:
        raise RigError(f"has no document: {AGAIN} as .glb")
    check_values(chunks[JSON_CHUNK])
    document = json.loads(bytes(chunks[JSON_CHUNK]))
    refuse_extensions(document)
    buffers = [load_buffer(path, buffer) for buffer in document.get("buffers", [])]
    if buffers and "uri" not in document["buffers"][0]:
        buffers[0] = chunks.get(BINARY_CHUNK, b"")
    gltf = Gltf(document, tuple(buffers))
    draco.unpack_mesh(gltf)
    return gltf


def glb_chunks(data: bytes) -> dict[int, bytes]:
    """The first chunk of each kind of a binary file."""
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise RigError(f"is glTF version {version}, expected 2: export it as glTF 2.0")
    if length > len(data):
        raise RigError(f"was cut off: it has {len(data):,} bytes, expected {length:,}: copy or export it again")
    chunks, start = {}, 12
    while start < length:
        size, kind = struct.unpack_from("<II", data, start)
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    return chunks


def load_buffer(path: Source, buffer: dict[str, Any]) -> bytes:
    """The bytes behind a buffer's address: in the file itself or beside it; none for the GLB's own or a placeholder."""
    if "uri" not in buffer:
        return b""
    uri = buffer["uri"]
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    name = unquote(uri)
    if ":" in name or "\\" in name or "\0" in name or name.startswith("/") or ".." in name.split("/"):
        raise RigError(f"refers to {uri[:80]!r}, which is outside its folder and is not read: export one .glb")
    file = sibling(path, name)
    if not name or not file.is_file():
        raise RigError(f"needs the file {uri[:80]!r}, which is not beside it: copy it there, or export one .glb")
    return content(file)


def refuse_extensions(document: dict[str, Any]) -> None:
    """RigError when reading the geometry needs an extension that is not known here."""
    needed = [str(name) for name in document.get("extensionsRequired", [])]
    unknown = [name for name in needed if name not in KNOWN and not name.startswith(HARMLESS)]
    if unknown:
        names = " and ".join(unknown)[:120]
        raise RigError(f"needs {names}, which is not read here: export it as .glb without compression")
