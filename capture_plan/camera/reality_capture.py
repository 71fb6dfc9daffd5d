"""Cameras of RealityCapture (RealityScan): a table of all, or an XMP file beside each image.

    CSV   #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2      z up; angles in degrees
          camera to world = Rz(-heading) Rx(pitch) Ry(roll), x right, y up, z backward
          f, px, py in millimetres of a film 36 mm wide along the longer side of the image
    XMP   Rotation: 9 numbers, world to camera, x right, y down, z forward; Position: the centre
          FocalLength35mm as f; PrincipalPointU, PrincipalPointV in parts of the longer side, from the middle
          DistortionCoeficients: k1 k2 k3 k4 t1 t2; each an attribute or an element
    u = w/2 + px L/36 + f L/36 x',  L the longer side. Pixels are taken to be counted from the corner of the first.
Neither holds the size of the images: it is read from the image beside, of the same name.
"""

import csv
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_plan.camera.calibration import Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.fields import (
    MOST_CAMERAS,
    OPENGL,
    distinct,
    listed,
    matrix,
    pinhole_lens,
    placed,
    polynomial_lens,
    radial_lens,
    radii,
    words,
)
from capture_plan.camera.image_size import size_beside
from capture_plan.errors import RigError

FILM_MM = 36.0
PIXEL = 0.5
COLUMNS = ("name", "x", "y", "alt", "heading", "pitch", "roll", "f")
TANGENTIAL = "t1 and t2 of its lens are taken for OpenCV's p1 and p2, which no document of the program says"
Size = tuple[int, int] | None


class Optics(NamedTuple):
    """A lens in parts of the longer side of the image: focal length, principal point from the middle, skew, aspect."""

    focal: float
    middle: Float[np.ndarray, "2"]
    lens: Float[np.ndarray, "6"]
    model: str = "brown"
    skew: float = 0.0
    aspect: float = 1.0


def read_reality_csv(text: str, path: Path, size_px: Size) -> Calibration:
    """The cameras of a table; `size_px` of their images where none lies beside."""
    lines = text.splitlines()
    start = next(n for n, line in enumerate(lines) if is_header(line))
    header = [name.strip().lower().lstrip("#") for name in lines[start].split(",")]
    cameras, notes = [], []
    for row in csv.reader(lines[start + 1 :][: MOST_CAMERAS + 1]):
        if not any(row) or row[0].startswith("#"):
            continue
        table = dict(zip(header, row, strict=False))
        where = f"{path}, {table['name'][:60]}"

        def of(*keys: str, table: dict[str, str] = table, where: str = where) -> Float[np.ndarray, " n"]:
            return np.array([words(table.get(key, "0") or "0", key, where, 1)[0] for key in keys])

        heading, pitch, roll = of("heading", "pitch", "roll")
        turn = Rotation.from_euler("ZXY", [-heading, pitch, roll], degrees=True).as_matrix()
        optics = Optics(of("f")[0] / FILM_MM, of("px", "py") / FILM_MM, of("k1", "k2", "k3", "k4", "t1", "t2"))
        camera, more = _camera(table["name"], optics, OPENGL @ turn.T, of("x", "y", "alt"), path, size_px)
        cameras.append(camera)
        notes += more
    return Calibration("RealityCapture CSV", distinct(tuple(cameras), str(path)), None, notes=tuple(notes))


def is_header(line: str) -> bool:
    """Whether a line names the columns of such a table."""
    names = [name.strip().lower().lstrip("#") for name in line.split(",")]
    return all(column in names for column in COLUMNS)


def read_reality_xmp(files: dict[Path, Element], path: Path, size_px: Size) -> Calibration:
    """The cameras of XMP files, each by its own; `size_px` of their images where none lies beside."""
    cameras, notes, left = [], [], []
    for file, root in files.items():
        table = {}
        for element in root.iter():
            table |= element.attrib | ({element.tag: element.text} if element.text else {})
        where = f"{path}, {file.name}"
        if not {"Rotation", "Position", "FocalLength35mm"} <= set(table):
            left.append(file.name)
            continue

        def of(key: str, count: int, table: dict[str, str] = table, where: str = where) -> Float[np.ndarray, " n"]:
            return words(table.get(key, " ".join("0" * count)), key, where, count)

        middle = np.concatenate([of("PrincipalPointU", 1), of("PrincipalPointV", 1)])
        skew, aspect = of("Skew", 1)[0], float(words(table.get("AspectRatio", "1"), "AspectRatio", where, 1)[0])
        model, focal = str(table.get("DistortionModel", "brown")), of("FocalLength35mm", 1)[0] / FILM_MM
        optics = Optics(focal, middle, of("DistortionCoeficients", 6), model, skew, aspect)
        camera, more = _camera(file.name, optics, of("Rotation", 9).reshape(3, 3), of("Position", 3), file, size_px)
        cameras.append(camera)
        notes += more
    if left:
        notes.append(f"left out, as no pose is stated: {listed(left)}")
    return Calibration("RealityCapture XMP", distinct(tuple(cameras), str(path)), None, notes=tuple(notes))


def _camera(
    name: str, optics: Optics, turn: Float[np.ndarray, "3 3"], centre: Float[np.ndarray, "3"], file: Path, size_px: Size
) -> tuple[Camera, tuple[str, ...]]:
    stem = name.rpartition(".")[0] or name
    where = f"{file}, {name[:60]}"
    if (size := size_beside(file, stem) or size_px) is None:
        raise RigError(
            f"{where}: the format does not hold the size of the images: lay the image beside it, or write a TOML file "
            "with [calibration], file and size = [width, height]"
        )
    longer = max(size)
    fx = optics.focal * longer
    cx, cy = np.array(size) / 2 + longer * optics.middle - PIXEL
    K = matrix(fx, fx * optics.aspect, cx, cy, optics.skew * longer)
    lens, notes = _lens(optics, K, size, where)
    return placed(stem, K, size, lens, turn, centre=centre), notes


def _lens(
    optics: Optics, K: Float[np.ndarray, "3 3"], size: tuple[int, int], where: str
) -> tuple[Float[np.ndarray, " n"], tuple[str, ...]]:
    k, p, model = optics.lens[:4], optics.lens[4:], optics.model.lower()
    notes = (TANGENTIAL,) if p.any() else ()
    if not k.any() or model.startswith(("perspective", "none")):
        return pinhole_lens([0, 0, *p, 0], where), notes
    if model.startswith("division"):  # straight = bent / (1 + k1 bent² + k2 bent⁴)
        bent = radii(K, size)
        lens, more = radial_lens(bent / (1 + k[0] * bent**2 + k[1] * bent**4), bent, K[0, 0], where, optics.model[:20])
        return lens, notes + more
    if not model.startswith("brown"):
        raise RigError(f"{where}: the lens model '{optics.model[:20]}' is not read: export it with brown3 or brown4")
    if k[3]:
        lens, more = polynomial_lens(k.tolist(), p.tolist(), K, size, where)
        return lens, notes + more
    return pinhole_lens([k[0], k[1], *p, k[2]], where), notes
