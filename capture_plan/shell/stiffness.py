"""Thin-shell stiffness of a triangle mesh (Botsch & Sorkine 2008; Le et al. 2013, eqs. 3-6).

Data       x_v in R^3, millimetres; triangles; stretching kS and bending kB
           L, M: cotangent Laplacian and mixed areas (`mesh/laplacian.py`)
Stiffness  A = -kS L + kB L M^-1 L: the energy of displacements d is d' A d; constants cost nothing

kB : kS has the unit of a squared length: 10 : 1 holds in millimetres only. A triangle without an area binds nothing.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csc_array, diags_array

from capture_plan.errors import RigError
from capture_plan.mesh import cotangent_laplacian, mixed_areas, with_area


def shell_stiffness(
    vertices: Float[np.ndarray, "v 3"], triangles: Int[np.ndarray, "f 3"], *, stretching: float, bending: float
) -> csc_array:
    """A, (v v).

    Raises:
        RigError: a vertex has no triangle with an area.
    """
    triangles = with_area(vertices, triangles)
    loose = np.flatnonzero(np.bincount(triangles.ravel(), minlength=len(vertices)) == 0)
    if len(loose):
        raise RigError(
            f"vertex {loose[0]} and {len(loose) - 1} others of the shell have no triangle with an area: leave them out"
        )
    # A = -kS L + kB L M^-1 L
    L, M = cotangent_laplacian(vertices, triangles), mixed_areas(vertices, triangles)
    return csc_array(-stretching * L + bending * (L @ diags_array(1 / M) @ L))
