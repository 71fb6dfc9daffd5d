"""Width and height of a PNG or JPEG image out of its first bytes, for camera files that do not say them."""

import struct
from pathlib import Path

MOST = 1 << 20  # bytes of a JPEG before its size stands: previews and colour profiles
KINDS = (".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG")


def size_beside(path: Path, stem: str) -> tuple[int, int] | None:
    """Size in pixels of the image of this name beside a file; None where there is none that is read here."""
    for kind in KINDS:
        image = path.parent / f"{stem}{kind}"
        try:
            if image.is_file():
                with image.open("rb") as file:
                    return size_of(file.read(MOST))
        except OSError:
            continue
    return None


def size_of(head: bytes) -> tuple[int, int] | None:
    """Width and height that the beginning of a PNG or JPEG states; None where it states none."""
    if head[:8] == b"\x89PNG\r\n\x1a\n" and len(head) >= 24:
        return struct.unpack_from(">II", head, 16)
    at = 2
    while head[:2] == b"\xff\xd8" and at + 9 <= len(head) and head[at] == 0xFF:
        kind, length = head[at + 1], struct.unpack_from(">H", head, at + 2)[0]
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", head, at + 5)
            return width, height
        at += 2 + length
    return None
