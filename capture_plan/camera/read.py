"""Cameras of a file or folder in any of the formats known here, told by what it holds more than by its name.

TOML     [[cameras]] our own; tables with matrix: Pose2Sim, Anipose, Caliscope
YAML     K_01 ...: EasyMocap; intrinsics with camera_model: Kalibr; else OpenCV, ROS
JSON     frames: nerfstudio, instant-ngp; else OpenCV
XML      <opencv_storage> OpenCV; <document> Metashape; <Cameras> Vicon XCP; <calibration> Qualisys; XMP RealityCapture
text     cameras.txt and images.txt COLMAP; #name,x,y,alt,... RealityCapture; blocks of K, lens and [R t] Multiface
binary   cameras.bin and images.bin COLMAP
folder   that holds intri.yml and extri.yml, or a COLMAP model (also in sparse/0), or XMP files beside images
"""

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from capture_plan.camera.calibration import UNITS, Calibration
from capture_plan.camera.camera import Camera
from capture_plan.camera.colmap import read_colmap_binary, read_colmap_text
from capture_plan.camera.easymocap import read_easymocap
from capture_plan.camera.fields import MOST_CAMERAS
from capture_plan.camera.kalibr import read_kalibr
from capture_plan.camera.metashape import read_metashape
from capture_plan.camera.multiface import is_krt, read_multiface
from capture_plan.camera.nerfstudio import read_nerfstudio
from capture_plan.camera.opencv import read_opencv, storage
from capture_plan.camera.own import read_own
from capture_plan.camera.pose2sim import camera_tables, read_pose2sim
from capture_plan.camera.qualisys import read_qualisys
from capture_plan.camera.reality_capture import is_header, read_reality_csv, read_reality_xmp
from capture_plan.camera.vicon import read_vicon
from capture_plan.errors import RigError
from capture_plan.input.documents import read_plain, read_toml
from capture_plan.input.trees import decoded, json_document, xml_document, yaml_document

GIVE = "give a camera file"
MOST_BYTES = 1 << 26  # of a document; a Metashape file of 1,000 cameras has 1 MB, a transforms.json as much
LEAST_FOCAL = 0.1  # of the image's width: 157 degrees, and no fisheye is shorter
MOST_OFF_MIDDLE = 0.35  # of the image: cut-outs of a sensor rarely lie farther from its axis
MOST_MODEL_BYTES = 1 << 28  # of COLMAP's images, with all points that were found in them
FORMATS = (
    "TOML ([[cameras]], Pose2Sim), OpenCV YAML, XML or JSON, EasyMocap, Kalibr, COLMAP, transforms.json, "
    "Metashape XML, RealityCapture CSV or XMP, Vicon XCP, Qualisys, KRT"
)


def read_cameras(path: str | Path, *, size_px: tuple[int, int] | None = None) -> Calibration:
    """The cameras of a file or folder, in its own world; `size_px` of the images, for a format that does not hold it.

    Raises:
        RigError: it is of no known format, or holds what no camera can be; the line says what to change.

    Example:
        >>> lines = ["[[cameras]]", "width = 640", "height = 480", "fx = 900.0", "fy = 900.0"]
        >>> lines += ["position = [0, 0, 500]", "look_at = [0, 0, 0]"]
        >>> _ = Path("stage.toml").write_text(chr(10).join(lines))
        >>> read = read_cameras("stage.toml")
        >>> read.format, read.unit, [camera.name for camera in read.cameras]
        ('[[cameras]]', 'millimetres', ['camera 1'])
    """
    path = Path(path)
    try:
        read = _folder(path, size_px) if path.is_dir() else _file(path, size_px)
    except RigError as error:
        if str(path) in str(error) or path.name in str(error):
            raise
        raise RigError(f"{path}: {error}") from error
    for camera in read.cameras:
        check_picture(camera, f"{path}, {camera.name[:60]}")
    mm = UNITS[read.unit or "millimetres"]
    return replace(read, cameras=tuple(replace(camera, position=mm * camera.position) for camera in read.cameras))


def check_picture(camera: Camera, where: str) -> None:
    """RigError where a lens and an image do not belong to each other, as no camera's: other units, sides exchanged."""
    width, height = camera.size_px
    fx, middle = camera.intrinsics[0, 0], camera.intrinsics[:2, 2]
    if fx < LEAST_FOCAL * width:
        raise RigError(
            f"{where}: its focal length is {fx:.4g} px for an image {width} px wide: it is in millimetres or in "
            "parts of the image: write it in pixels (millimetres x image width / sensor width in millimetres)"
        )
    if np.any(np.abs(middle / [width, height] - 0.5) > MOST_OFF_MIDDLE):
        raise RigError(
            f"{where}: its principal point is ({middle[0]:.4g}, {middle[1]:.4g}) in an image of {width} x {height} px: "
            "count it from the first pixel, not from the middle, in pixels, and width before height"
        )


def _file(path: Path, size_px: tuple[int, int] | None) -> Calibration:
    if path.suffix.lower() == ".toml":
        return _toml(read_toml(path, RigError, GIVE), path)
    if path.name in ("cameras.txt", "images.txt", "cameras.bin", "images.bin"):
        return _colmap(path.parent, path.suffix)
    content = read_plain(path, RigError, GIVE, most=MOST_BYTES)
    text = decoded(content, str(path), RigError)
    start = text.lstrip()
    if start.startswith("<"):
        return _xml(xml_document(start, str(path), RigError), path, size_px)
    if start.startswith("{"):
        document = json_document(start, str(path), RigError)
        return read_nerfstudio(document, path) if "frames" in document else read_opencv(document, path)
    if any(is_header(line) for line in start[:10_000].splitlines()[:20]):
        return read_reality_csv(start, path, size_px)
    if is_krt(start):
        return read_multiface(start, path)
    if path.suffix.lower() in (".yml", ".yaml") or start.startswith("%YAML"):
        return _yaml(yaml_document(text, str(path), RigError), path)
    raise RigError(f"{path} is of no format that is known here: expected {FORMATS}")


def _toml(content: dict[str, Any], path: Path) -> Calibration:
    return (
        read_pose2sim(content, path) if "cameras" not in content and camera_tables(content) else read_own(content, path)
    )


def _yaml(document: Any, path: Path) -> Calibration:
    if isinstance(document, dict):
        if any(str(key).startswith(("K_", "Rot_", "T_")) for key in document):
            return _easymocap(path.parent)
        if any(isinstance(one, dict) and {"intrinsics", "resolution"} <= set(one) for one in document.values()):
            return read_kalibr(document, path)
    return read_opencv(document, path)


def _xml(root: Element, path: Path, size_px: tuple[int, int] | None) -> Calibration:
    if root.tag == "opencv_storage":
        return read_opencv(storage(root), path)
    if root.tag == "Cameras" or root.find(".//Camera/KeyFrames") is not None:
        return read_vicon(root, path)
    if root.find(".//camera/intrinsic") is not None:
        return read_qualisys(root, path)
    if root.tag in ("document", "chunk") or root.find(".//chunk") is not None:
        return read_metashape(root, path)
    if root.tag in ("xmpmeta", "RDF"):
        return read_reality_xmp({path: root}, path, size_px)
    raise RigError(
        f"{path} is XML whose root is <{root.tag[:40]}>, which is of no format known here: expected {FORMATS}"
    )


def _folder(path: Path, size_px: tuple[int, int] | None) -> Calibration:
    for below in (path, path / "sparse" / "0", path / "sparse", path / "0"):
        for kind in (".bin", ".txt"):
            if (below / f"cameras{kind}").is_file() and (below / f"images{kind}").is_file():
                return _colmap(below, kind)
    if any((path / name).is_file() for name in ("intri.yml", "extri.yml")):
        return _easymocap(path)
    files = sorted(file for file in path.iterdir() if file.suffix.lower() == ".xmp" and file.is_file())
    if files:
        if len(files) > MOST_CAMERAS:
            raise RigError(
                f"{path} holds {len(files):,} XMP files, expected at most {MOST_CAMERAS:,}: give one frame's"
            )
        roots = {file: xml_document(_text(file).lstrip(), str(file), RigError) for file in files}
        return read_reality_xmp(roots, path, size_px)
    raise RigError(
        f"{path} is a folder without cameras, expected intri.yml and extri.yml, cameras.txt and images.txt (or .bin), "
        f"or .xmp files: {GIVE}"
    )


def _text(path: Path, most: int = MOST_BYTES) -> str:
    return decoded(read_plain(path, RigError, GIVE, most=most), str(path), RigError)


def _easymocap(folder: Path) -> Calibration:
    documents = []
    for name in ("intri.yml", "extri.yml"):
        document = yaml_document(_text(folder / name), str(folder / name), RigError)
        documents.append(document if isinstance(document, dict) else {})
    return read_easymocap(documents[0], documents[1], folder)


def _colmap(folder: Path, kind: str) -> Calibration:
    cameras, images = (folder / f"{name}{kind}" for name in ("cameras", "images"))
    if kind == ".txt":
        return read_colmap_text(_text(cameras), _text(images, MOST_MODEL_BYTES), folder)
    read = [read_plain(file, RigError, GIVE, most=MOST_MODEL_BYTES) for file in (cameras, images)]
    return read_colmap_binary(read[0], read[1], folder)
