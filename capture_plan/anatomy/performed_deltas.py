"""The shapes that a face takes when its blendshapes are performed, one at a time.

d'_k = d_k + sum of d_j over what k corrects: a corrective, as ARKit's mouthClose is one of jawOpen, is no movement of
its own. Alone at full weight it pushes the lower lip through the upper one, and no camera ever sees that.
"""

import numpy as np
from jaxtyping import Float

from capture_plan.anatomy.delta_relations import correctives
from capture_plan.rig.record import Rig


def performed_deltas(rig: Rig, used: tuple[str, ...]) -> Float[np.ndarray, "k v 3"]:
    """The movement of each `used` blendshape, a corrective's together with what it corrects, millimetres."""
    deltas = rig.deltas[rig.rows(used)]
    for finding in correctives(rig, used):
        corrective, *corrected = finding.blendshapes
        for name in corrected:
            deltas[used.index(corrective)] += rig.deltas[rig.names.index(name)]
    return deltas
