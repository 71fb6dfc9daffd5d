"""Cameras of our own numbers, written in every format that is read, by each format's own definition."""

import json
import struct
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

OPENGL = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Known:
    """A camera as OpenCV takes it: K, lens, R, t (world to camera, in the unit of the file), width and height."""

    name: str
    K: np.ndarray
    lens: tuple
    R: np.ndarray
    t: np.ndarray
    size: tuple = (1920, 1080)
    fisheye: bool = False

    @property
    def centre(self):
        return -self.R.T @ self.t

    def pixels(self, points):
        """What OpenCV says of these points of the world."""
        rvec, lens = cv2.Rodrigues(self.R)[0], np.array(self.lens, dtype=float)
        given = points.reshape(-1, 1, 3), rvec, self.t.reshape(3, 1), np.array(self.K)
        if self.fisheye:
            return cv2.fisheye.projectPoints(*given, lens)[0].reshape(-1, 2)
        return cv2.projectPoints(*given, lens)[0].reshape(-1, 2)


def stage(mm=1.0, **changed):
    """Three cameras round a head at (0, 690, 100) mm, that look a little past its middle and are rolled a little."""
    places = [(-250, 730, 420), (120, 610, 520), (330, 690, 330)]
    lenses = [(0.05, -0.12, 0.0013, -0.0021, 0.02), (-0.08, 0.03, -0.0007, 0.0009, 0.0), (0.01, 0, 0.002, 0.001, 0)]
    cameras = []
    for n, (place, lens) in enumerate(zip(places, lenses, strict=True)):
        ahead = np.array([5.0 * n, 690, 100]) - place
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0, 1.0, 0])
        right /= np.linalg.norm(right)
        R = Rotation.from_rotvec([0, 0, 0.05 * n - 0.04]).as_matrix() @ np.stack([right, np.cross(ahead, right), ahead])
        K = np.array([[1400.0 + 7 * n, 0, 955.3 + n], [0, 1395.5 + n, 536.9 - n], [0, 0, 1]])
        known = Known(f"c{n + 1}", K, lens, R, -R @ np.array(place) / mm)
        cameras.append(replace(known, **changed))
    return cameras


def with_square_pixels(cameras):
    return [
        replace(one, K=np.array([[one.K[0, 0], 0, one.K[0, 2]], [0, one.K[0, 0], one.K[1, 2]], [0, 0, 1]]))
        for one in cameras
    ]


def pose2sim(folder: Path, cameras):
    lines = []
    for one in cameras:
        lines += [f"[{one.name}]", f'name = "{one.name}"', f"size = {[float(n) for n in one.size]}"]
        lines += [f"matrix = {one.K.tolist()}", f"distortions = {list(map(float, one.lens))}"]
        lines += [f"rotation = {cv2.Rodrigues(one.R)[0].ravel().tolist()}", f"translation = {one.t.tolist()}"]
        lines += [f"fisheye = {str(one.fisheye).lower()}"]
    path = folder / "Calib.toml"
    path.write_text("\n".join([*lines, "[metadata]", "adjusted = false", "error = 0.0"]))
    return path


def opencv(folder: Path, cameras, kind="yml"):
    """As cv2.FileStorage itself writes it; a mapping of each camera."""
    path = folder / f"cameras.{kind}"
    out = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for one in cameras:
        out.startWriteStruct(one.name, cv2.FILE_NODE_MAP)
        out.write("image_width", one.size[0])
        out.write("image_height", one.size[1])
        out.write("fisheye", int(one.fisheye))
        out.write("camera_matrix", one.K)
        out.write("distortion_coefficients", np.array(one.lens, dtype=float).reshape(1, -1))
        out.write("R", one.R)
        out.write("T", one.t.reshape(3, 1))
        out.endWriteStruct()
    out.release()
    return path


def stereo(folder: Path, cameras, kind="yml"):
    """The pair of the first two, their world the first camera; rectification beside it, as OpenCV's example writes."""
    one, two = cameras[:2]
    path = folder / f"stereo.{kind}"
    out = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    R = two.R @ one.R.T
    entries = {"M1": one.K, "D1": np.array([one.lens]), "M2": two.K, "D2": np.array([two.lens])}
    entries |= {"R": R, "T": two.t - R @ one.t, "R1": np.eye(3), "R2": R, "P1": np.zeros((3, 4)), "Q": np.eye(4)}
    for name, value in entries.items():
        out.write(name, value)
    out.write("image_size", np.array([one.size], dtype=float))
    out.release()
    return path


def easymocap(folder: Path, cameras, matrix=False):
    intri = cv2.FileStorage(str(folder / "intri.yml"), cv2.FILE_STORAGE_WRITE)
    extri = cv2.FileStorage(str(folder / "extri.yml"), cv2.FILE_STORAGE_WRITE)
    for n, one in enumerate(cameras, start=1):
        intri.write(f"K_0{n}", one.K)
        intri.write(f"dist_0{n}", np.array([one.lens]))
        intri.write(f"W_0{n}", one.size[0])
        intri.write(f"H_0{n}", one.size[1])
        if not matrix or n > 1:
            extri.write(f"R_0{n}", cv2.Rodrigues(one.R)[0])
        extri.write(f"Rot_0{n}", one.R)
        extri.write(f"T_0{n}", one.t.reshape(3, 1))
    intri.release()
    extri.release()
    return folder


def four(R, t):
    return np.vstack([np.column_stack([R, t]), [0, 0, 0, 1]])


def kalibr(folder: Path, cameras):
    """A chain whose world is the first camera."""
    lines, before = [], None
    for n, one in enumerate(cameras):
        pose, model = four(one.R, one.t), "equidistant" if one.fisheye else "radtan"
        lines += [f"cam{n}:", "  camera_model: pinhole", f"  distortion_model: {model}"]
        lines += [f"  intrinsics: [{one.K[0, 0]}, {one.K[1, 1]}, {one.K[0, 2]}, {one.K[1, 2]}]"]
        lines += [f"  distortion_coeffs: {list(map(float, one.lens[:4]))}", f"  resolution: {list(one.size)}"]
        lines += [f"  rostopic: /cam{n}/image_raw", "  cam_overlaps: [1]"]
        if before is not None:
            lines += ["  T_cn_cnm1:", *(f"  - {row}" for row in (pose @ np.linalg.inv(before)).tolist())]
        before = pose
    path = folder / "camchain.yaml"
    path.write_text("\n".join(lines) + "\n")
    return path


COLMAP = {  # number in binary files; K and lens to the parameters
    "PINHOLE": (1, lambda K, k: []),
    "SIMPLE_RADIAL": (2, lambda K, k: [k[0]]),
    "RADIAL": (3, lambda K, k: [k[0], k[1]]),
    "OPENCV": (4, lambda K, k: list(k[:4])),
    "OPENCV_FISHEYE": (5, lambda K, k: list(k[:4])),
    "FULL_OPENCV": (6, lambda K, k: list(k[:8])),
}


def colmap(folder: Path, cameras, model="OPENCV", binary=False, pixel=0.5):
    number, lens = COLMAP[model]
    one_focal = model in ("SIMPLE_RADIAL", "RADIAL")
    sensors, images = [], []
    sensors_bin, images_bin = struct.pack("<Q", len(cameras)), struct.pack("<Q", len(cameras))
    for n, one in enumerate(cameras, start=1):
        focal = [one.K[0, 0]] if one_focal else [one.K[0, 0], one.K[1, 1]]
        numbers = [*focal, one.K[0, 2] + pixel, one.K[1, 2] + pixel, *lens(one.K, one.lens)]
        x, y, z, w = Rotation.from_matrix(one.R).as_quat()
        sensors += [f"{n} {model} {one.size[0]} {one.size[1]} {' '.join(map(repr, map(float, numbers)))}"]
        images += [f"{n} {w:.17g} {x:.17g} {y:.17g} {z:.17g} {' '.join(map(repr, one.t.tolist()))} {n} {one.name}.png"]
        images += ["" if n == 1 else "100.5 200.25 -1 7.0 8.0 3"]
        sensors_bin += struct.pack("<iiQQ", n, number, *one.size) + struct.pack(f"<{len(numbers)}d", *numbers)
        images_bin += struct.pack("<i7di", n, w, x, y, z, *one.t, n) + f"{one.name}.png".encode() + b"\0"
        images_bin += struct.pack("<Q", n) + struct.pack("<ddq", 1.0, 2.0, -1) * n
    if binary:
        (folder / "cameras.bin").write_bytes(sensors_bin)
        (folder / "images.bin").write_bytes(images_bin)
    else:
        (folder / "cameras.txt").write_text("\n".join(["# Camera list", "#   CAMERA_ID, MODEL", *sensors]) + "\n")
        (folder / "images.txt").write_text("\n".join(["# Image list", *images]) + "\n")
    return folder


def nerfstudio(folder: Path, cameras, k4=0.0, applied=None, pixel=0.5, opengl=True):
    frames = []
    for one in cameras:
        pose = four(one.R.T @ (OPENGL if opengl else np.eye(3)), one.centre)
        if applied is not None:
            pose = applied @ pose
        k1, k2, p1, p2, *k3 = one.lens
        names = {"k1": k1, "k2": k2, "k3": p1, "k4": p2} if one.fisheye else {"k1": k1, "k2": k2, "p1": p1, "p2": p2}
        names |= {} if one.fisheye else {"k3": k3[0] if k3 else 0.0, "k4": k4}
        frame = {"file_path": f"images/{one.name}.png", "transform_matrix": pose.tolist(), "w": one.size[0]}
        frame |= {"h": one.size[1], "fl_x": one.K[0, 0], "fl_y": one.K[1, 1]} | names
        frames.append(frame | {"cx": one.K[0, 2] + pixel, "cy": one.K[1, 2] + pixel})
    document = {"camera_model": "OPENCV_FISHEYE" if cameras[0].fisheye else "OPENCV", "frames": frames}
    if applied is not None:
        document["applied_transform"] = applied[:3].tolist()
    path = folder / "transforms.json"
    path.write_text(json.dumps(document))
    return path


def metashape(folder: Path, cameras, k4=0.0, swapped=True, chunk=None, pixel=0.5):
    """Cameras in a chunk that is turned, moved and scaled against the world."""
    R, t, s = chunk or (Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix(), np.array([1.0, -2, 3]), 7.5)
    sensors, places = "", ""
    for n, one in enumerate(cameras):
        k1, k2, p1, p2, *k3 = one.lens
        p1, p2 = (p2, p1) if swapped and not one.fisheye else (p1, p2)
        lens = (
            dict(zip(("k1", "k2", "k3", "k4"), one.lens, strict=False))
            if one.fisheye
            else {"k1": k1, "k2": k2, "k3": k3[0], "k4": k4, "p1": p1, "p2": p2}
        )
        values = {"f": one.K[1, 1], "cx": one.K[0, 2] + pixel - one.size[0] / 2}
        values |= {
            "cy": one.K[1, 2] + pixel - one.size[1] / 2,
            "b1": one.K[0, 0] - one.K[1, 1],
            "b2": one.K[0, 1],
        } | lens
        parts = "".join(f"<{key}>{float(value):.17g}</{key}>" for key, value in values.items())
        kind = "fisheye" if one.fisheye else "frame"
        size = f'width="{one.size[0]}" height="{one.size[1]}"'
        sensors += (
            f'<sensor id="{n}" label="s" type="{kind}"><resolution {size}/><calibration type="{kind}" class="adjusted">'
        )
        sensors += f"<resolution {size}/>{parts}</calibration></sensor>"
        local = four(R.T @ one.R.T, R.T @ (one.centre - t) / s)
        text = " ".join(repr(float(x)) for x in local.ravel())
        places += f'<camera id="{n}" sensor_id="{n}" label="{one.name}"><transform>{text}</transform></camera>'
    rows = " ".join(repr(float(x)) for x in R.ravel())
    world = f"<rotation>{rows}</rotation><translation>{t[0]} {t[1]} {t[2]}</translation><scale>{s}</scale>"
    path = folder / "cameras.xml"
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?><document version="2.0.0"><chunk label="Chunk 1" enabled="true">'
        f'<sensors next_id="9">{sensors}</sensors><cameras next_id="9"><group id="0">{places}</group>'
        f'<camera id="77" sensor_id="0" label="lost"/></cameras><transform>{world}</transform></chunk></document>'
    )
    return path


def picture(folder: Path, name, size):
    """A PNG of which only the beginning is there."""
    (folder / name).write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", *size) + b"\x08\x02\0\0\0")


def reality_csv(folder: Path, cameras, k4=0.0, images=True):
    lines = ["#cameras 3", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"]
    for one in cameras:
        longer = max(one.size)
        yaw, pitch, roll = Rotation.from_matrix(one.R.T @ OPENGL).as_euler("ZXY", degrees=True)
        k1, k2, p1, p2, k3 = one.lens
        film = 36 / longer
        middle = (one.K[:2, 2] + 0.5 - np.array(one.size) / 2) * film
        row = [*one.centre, -yaw, pitch, roll, one.K[0, 0] * film, *middle, k1, k2, k3, k4, p1, p2]
        lines.append(",".join([f"{one.name}.png", *(repr(float(x)) for x in row)]))
        if images:
            picture(folder, f"{one.name}.png", one.size)
    path = folder / "cameras.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def reality_xmp(folder: Path, cameras, attributes=False, model="brown3", coefficients=None, images=True):
    for one in cameras:
        longer = max(one.size)
        k1, k2, p1, p2, k3 = one.lens
        middle = (one.K[:2, 2] + 0.5 - np.array(one.size) / 2) / longer
        texts = {
            "Rotation": " ".join(repr(float(x)) for x in one.R.ravel()),
            "Position": " ".join(repr(float(x)) for x in one.centre),
            "DistortionCoeficients": " ".join(map(repr, map(float, coefficients or (k1, k2, k3, 0, p1, p2)))),
        }
        inside = "" if attributes else "".join(f"<xcr:{key}>{value}</xcr:{key}>" for key, value in texts.items())
        outside = "".join(f' xcr:{key}="{value}"' for key, value in texts.items()) if attributes else ""
        (folder / f"{one.name}.xmp").write_text(
            '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
            '<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:Version="3"'
            f' xcr:DistortionModel="{model}" xcr:FocalLength35mm="{one.K[0, 0] * 36 / longer:.17g}" xcr:Skew="0"'
            f' xcr:AspectRatio="1" xcr:PrincipalPointU="{middle[0]:.17g}" xcr:PrincipalPointV="{middle[1]:.17g}"'
            f"{outside}>"
            f"{inside}</rdf:Description></rdf:RDF></x:xmpmeta>"
        )
        if images:
            picture(folder, f"{one.name}.png", one.size)
    return folder


def vicon(folder: Path, cameras, radial="", w_last=True):
    text = '<?xml version="1.0" encoding="UTF-8"?><Cameras NAME="" VERSION="1.0">'
    for n, one in enumerate(cameras):
        quaternion = Rotation.from_matrix(one.R).as_quat()
        quaternion = quaternion if w_last else np.roll(quaternion, 1)
        text += f'<Camera DEVICEID="{n}" NAME="{one.name}" PIXEL_ASPECT_RATIO="{one.K[0, 0] / one.K[1, 1]:.17g}"'
        text += (
            f' SENSOR_SIZE="{one.size[0]} {one.size[1]}" TYPE="Vue" USERID="{n}"><ThresholdGrid/><KeyFrames><KeyFrame'
        )
        text += (
            f' FOCAL_LENGTH="{one.K[0, 0]:.17g}" FRAME="0" ORIENTATION="{" ".join(map(repr, map(float, quaternion)))}"'
        )
        text += f' POSITION="{" ".join(map(repr, map(float, one.centre)))}"'
        cx, cy = one.K[:2, 2]
        text += f' PRINCIPAL_POINT="{cx:.17g} {cy:.17g}" {radial.format(cx=cx, cy=cy)}/>'
        text += "</KeyFrames></Camera>"
    path = folder / "session.xcp"
    path.write_text(text + '<Camera DEVICEID="99" SENSOR_SIZE="1 1"><KeyFrames/></Camera></Cameras>')
    return path


def qualisys(folder: Path, cameras, parts=64, left=32, top=8):
    text = '<?xml version="1.0"?><calibration calibrated="2024-01-01" source="a.qtm"><cameras>'
    for n, one in enumerate(cameras):
        rows = OPENGL @ one.R
        turn = " ".join(f'r{i + 1}{j + 1}="{float(rows[i, j]):.17g}"' for i in range(3) for j in range(3))
        place = " ".join(f'{axis}="{float(x):.17g}"' for axis, x in zip("xyz", one.centre, strict=True))
        k1, k2, p1, p2, k3 = map(float, one.lens)
        view = f'left="{left}" top="{top}" right="{left + one.size[0] - 1}" bottom="{top + one.size[1] - 1}"'
        text += f'<camera active="1" calibrated="true" serial="{n}" model="Miqus Video"><fov_marker left="0" top="0"'
        text += f' right="9" bottom="9"/><fov_video {view}/><transform {place} {turn}/><intrinsic focallength="12.5"'
        text += f' focalLengthU="{one.K[0, 0] * parts:.17g}" focalLengthV="{one.K[1, 1] * parts:.17g}"'
        cx, cy = (one.K[:2, 2] + [left, top]) * parts
        text += f' centerPointU="{cx:.17g}" centerPointV="{cy:.17g}" skew="0"'
        text += f' radialDistortion1="{k1:.17g}" radialDistortion2="{k2:.17g}" radialDistortion3="{k3:.17g}"'
        text += f' tangentalDistortion1="{p1:.17g}" tangentalDistortion2="{p2:.17g}"/></camera>'
    path = folder / "calibration.qca.txt"
    path.write_text(text + "</cameras></calibration>")
    return path


def multiface(folder: Path, cameras):
    lines = []
    for n, one in enumerate(cameras):
        rows = [*one.K, one.lens, *np.column_stack([one.R, one.t])]
        lines += [f"40000{n}", *(" ".join(repr(float(x)) for x in row) for row in rows), ""]
    path = folder / "KRT"
    path.write_text("\n".join(lines))
    return path
