"""One offscreen renderer for the process, behind a lock: coloured triangles in, picture and depth out.

pyrender keeps one OpenGL context, which belongs to one thread at a time, so whoever draws takes the lock, makes the
context current, draws and lets go of it. Cameras are orthographic: a millimetre has the same size everywhere.

Letters: v vertices, f triangles, p q pixel rows and columns. Camera space: x right, y up, z towards the camera.
"""

import ctypes
import os
import threading
from dataclasses import dataclass, replace
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from capture_plan.errors import CapturePlanError

MARGIN_MM = 10.0  # of depth before and behind what is drawn, so that nothing is clipped
_lock = threading.Lock()


class RenderError(CapturePlanError):
    """Pictures cannot be drawn on this machine."""


@dataclass(frozen=True, eq=False)
class LitSurface:
    """Triangles in camera space, millimetres, with display colours and opacity from 0 to 1, interpolated between."""

    vertices: Float[np.ndarray, "v 3"]
    triangles: Int[np.ndarray, "f 3"]
    rgba: Float[np.ndarray, "v 4"]


def draw(
    surfaces: tuple[LitSurface, ...],
    *,
    centre: tuple[float, float],
    size_mm: tuple[float, float],
    size_px: tuple[int, int],
) -> tuple[UInt8[np.ndarray, "p q 4"], Float[np.ndarray, "p q"]]:
    """Colour with straight alpha, and the z of what is seen in each pixel, millimetres; -inf where nothing is.

    `size_mm` and `size_px` are (width, height) of the picture around `centre` (x, y).
    """
    with _lock:
        gl = _renderer()
        gl.offscreen.viewport_width, gl.offscreen.viewport_height = size_px
        low = min(float(surface.vertices[:, 2].min()) for surface in surfaces) - MARGIN_MM
        high = max(float(surface.vertices[:, 2].max()) for surface in surfaces) + MARGIN_MM
        shown = [one for one in (in_frame(each, centre, size_mm) for each in surfaces) if len(one.triangles)]
        scene = _scene(gl.pyrender, tuple(shown) or surfaces[:1])
        pose = np.eye(4)
        pose[:3, 3] = centre[0], centre[1], high + 1
        near, far = 1.0, high + 1 - low
        camera = gl.pyrender.OrthographicCamera(xmag=size_mm[0] / 2, ymag=size_mm[1] / 2, znear=near, zfar=far)
        scene.add(camera, pose=pose)
        colour, depth = gl.offscreen.render(scene, flags=gl.pyrender.RenderFlags.RGBA | gl.pyrender.RenderFlags.FLAT)
    return colour, _z_of_depth(depth, near, far, high + 1)


def in_frame(surface: LitSurface, centre: tuple[float, float], size_mm: tuple[float, float]) -> LitSurface:
    """The surface without triangles that lie beside the picture: most of a head, in a close-up."""
    away = (surface.vertices[:, :2] - centre) / (np.array(size_mm) / 2)
    beyond = np.concatenate([away > 1, away < -1], axis=1)  # on which of the four sides each vertex lies
    a, b, c = surface.triangles.T
    beside = (beyond[a] & beyond[b] & beyond[c]).any(axis=-1)
    return replace(surface, triangles=surface.triangles[~beside]) if beside.any() else surface


def _z_of_depth(depth: Float[np.ndarray, "p q"], near: float, far: float, camera_z: float) -> Float[np.ndarray, "p q"]:
    """pyrender undoes a perspective: d = 2 n f / (f + n - s (f - n)); orthographic is (s (f - n) + f + n) / 2."""
    seen = depth > 0
    s = (far + near - 2 * near * far / np.where(seen, depth, near)) / (far - near)
    return np.where(seen, camera_z - (s * (far - near) + far + near) / 2, -np.inf)


def _scene(pyrender: ModuleType, surfaces: tuple[LitSurface, ...]) -> Any:
    """One mesh of all surfaces: pyrender draws the parts of a mesh in their order, but meshes in any.

    What is seen through comes last; of the others the nearest triangles come first, so that what they hide is never
    coloured.
    """
    scene = pyrender.Scene(bg_color=(1.0, 1.0, 1.0, 0.0))
    primitives = []
    for surface in sorted(surfaces, key=lambda surface: surface.rgba[:, 3].min() < 1):
        nearest_first = np.argsort(-surface.vertices[:, 2][surface.triangles].sum(axis=1), kind="stable")
        mode = "OPAQUE" if surface.rgba[:, 3].min() == 1 else "BLEND"
        order = nearest_first if mode == "OPAQUE" else nearest_first[::-1]
        primitives.append(
            pyrender.Primitive(
                positions=surface.vertices.astype(np.float32),
                indices=surface.triangles[order].astype(np.uint32),
                color_0=surface.rgba.astype(np.float32),
                material=pyrender.MetallicRoughnessMaterial(
                    alphaMode=mode, doubleSided=True, baseColorFactor=(1.0, 1.0, 1.0, 1.0)
                ),
            )
        )
    scene.add(pyrender.Mesh(primitives))
    return scene


@cache
def _renderer() -> SimpleNamespace:
    """pyrender and its one offscreen renderer, made when the first picture is drawn."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")  # must stand before the first import
    os.environ.setdefault("PYGLET_HEADLESS", "1")
    try:
        import pyrender
        from pyrender.platforms.egl import EGLPlatform

        setattr(EGLPlatform, "make_uncurrent", _make_uncurrent)  # noqa: B010  pyright knows the one it replaces
        setattr(EGLPlatform, "delete_context", _delete_context)  # noqa: B010  the same
        _register_argument_type()
        offscreen = pyrender.OffscreenRenderer(64, 64)
        _make_uncurrent(offscreen._platform)
    except Exception as error:  # PyOpenGL raises AttributeError, ImportError, GLError or AssertionError, by machine
        raise RenderError(
            "pictures need OpenGL without a screen, which this machine lacks: install libegl1 and libgl1 "
            f"(apt-get install --no-install-recommends libegl1 libgl1); {type(error).__name__}: {error}"
        ) from error
    return SimpleNamespace(pyrender=pyrender, offscreen=offscreen)


def _make_uncurrent(platform: Any) -> None:
    """pyrender leaves the context with the thread, so that no other thread could draw."""
    from OpenGL.EGL import EGL_NO_CONTEXT, EGL_NO_SURFACE, eglMakeCurrent

    eglMakeCurrent(platform._egl_display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT)


def _delete_context(platform: Any) -> None:
    """pyrender closes the display, which would end every other context of the process."""
    from OpenGL.EGL import eglDestroyContext

    if platform._egl_context is not None:
        _make_uncurrent(platform)
        eglDestroyContext(platform._egl_display, platform._egl_context)
        platform._egl_context = None


def _register_argument_type() -> None:
    """From Python 3.12 the type of `byref` has another name than PyOpenGL 3.1.0 looks for."""
    from OpenGL.plugins import FormatHandler

    kind = type(ctypes.byref(ctypes.c_int()))
    name = f"{kind.__module__}.{kind.__name__}"
    if not any(name in handler.check for handler in FormatHandler.all()):
        FormatHandler("ctypesparameter", "OpenGL.arrays.ctypesparameters.CtypesParameterHandler", [name])
