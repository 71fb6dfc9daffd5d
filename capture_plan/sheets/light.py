"""The light of a portrait, worked out per vertex: soft key from the upper left, cooler fill, sky, and dark edges.

The shown mesh is finer than a printed dot of light could tell, so colours are computed here and only interpolated when
drawn: quicker than per pixel in software, and the heat map keeps its colours.

Data     n        unit normal in view space (x right, y up, z to the viewer)
         o        openness: share of the hemisphere from which the place is seen, 0 to 1
         a        linear colour of the material
Model    E   = sum_l c_l max(0, (n . l + w) / (1 + w)) o^(1/2)  +  sky (1 + n_y) / 2 o  +  ground (1 - n_y) / 2 o
         rgb = ((a E (1 - edge (1 - n_z)^3) + gloss max(0, n . h)^sharp) ^ (1 / 2.2)
Letters  v vertices, l lights
"""

import numpy as np
from jaxtyping import Float

WRAP = 0.18  # w: light creeps round the skin's terminator
# (towards the light, colour times intensity): a lit cheek prints near 0.9 of white, the shadow of the chin near 0.5
KEY = ((-0.50, 0.62, 0.72), (0.80, 0.79, 0.775))
FILL = ((0.80, 0.10, 0.62), (0.19, 0.195, 0.205))
SKY, GROUND = np.array([0.25, 0.255, 0.265]), np.array([0.17, 0.165, 0.16])
EDGE = 0.55  # how much darker the outline is, so that it stands out from white paper


def lit(
    normals: Float[np.ndarray, "v 3"],
    openness: Float[np.ndarray, " v"],
    colours: Float[np.ndarray, "v 3"],
    *,
    gloss: float,
    sharp: float,
) -> Float[np.ndarray, "v 3"]:
    """Display colours from 0 to 1."""
    n, o = normals, openness[:, None]
    up = n[:, 1:2]
    received = (SKY * (1 + up) / 2 + GROUND * (1 - up) / 2) * o
    for towards, strength in (KEY, FILL):
        along = n @ _unit(towards)
        received = received + np.sqrt(o) * np.maximum(0, (along[:, None] + WRAP) / (1 + WRAP)) * np.array(strength)
    facing = np.clip(n[:, 2:3], 0, 1)
    halfway = _unit(np.array(_unit(KEY[0])) + np.array([0, 0, 1]))
    shine = gloss * np.maximum(0, n @ halfway)[:, None] ** sharp * o
    linear = colours * received * (1 - EDGE * (1 - facing) ** 3) + shine
    return np.clip(linear, 0, 1) ** (1 / 2.2)


def _unit(direction: tuple[float, float, float] | Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    return np.asarray(direction) / np.linalg.norm(direction)
