"""What a plan keeps apart because it would run through itself on the mesh."""

from capture_plan.expressions.collision import colliding_pairs
from capture_plan.expressions.settings import PackingSettings
from capture_plan.expressions.together import performed_together
from capture_plan.rig import Rig


def collide(rig: Rig, used: tuple[str, ...], settings: PackingSettings) -> tuple[tuple[str, str], ...]:
    """Blendshapes whose surfaces run through each other when performed at once; none where anything goes."""
    if not settings.poseable:
        return ()
    return colliding_pairs(rig, used, performed_together(rig, used) if settings.paired else ())
