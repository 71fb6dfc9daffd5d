"""What other programs read: files of a plan, by kinds (`kinds.KINDS`), for the command line and for notebooks."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from capture_plan.exports.kinds import KINDS, WRITES, Kind

if TYPE_CHECKING:
    from capture_plan.plan.inputs import PlanInputs
    from capture_plan.plan.record import Plan
    from capture_plan.rig import Rig

__all__ = ["KINDS", "WRITES", "Kind", "write_exports"]


def write_exports(
    plan: "Plan",
    inputs: "Rig | PlanInputs",
    folder: Path | str,
    *,
    only: Iterable[str],
    rig_file: Path | str | None = None,
) -> list[Path]:
    """Write these kinds of files into `folder`, all or none; `rig_file` is the file or folder that the rig was read
    from, for what is written on the artist's own mesh.

    Raises:
        PlanError: there is no such kind, the plan or its rig have nothing that it could be made from, a library is
            missing, or the place cannot be written.
        RigError: the artist's file cannot be read.

    Example:
        >>> rig = sample_rig()
        >>> [path.name for path in write_exports(make_plan(rig), rig, "out", only=["trc"])]
        ['markers.trc']
    """
    from capture_plan.errors import PlanError
    from capture_plan.exports.delivery import Delivery
    from capture_plan.output import written_together
    from capture_plan.plan.inputs import inputs_for
    from capture_plan.plan.record import number_of, whose_words

    wanted = tuple(only)
    for name in wanted:
        if name not in KINDS:
            raise PlanError(f"'{name}' is no kind of export: choose among {', '.join(KINDS)}")
    takes = "verify" in wanted
    given, folder = inputs_for(inputs, plan.settings, takes=takes, carried=plan.cameras), Path(folder)
    of = Delivery(plan, given, Path(rig_file) if rig_file else None, folder)
    with written_together(folder, whose_words(plan), number_of(plan)) as new:
        written = [path for name in wanted for path in KINDS[name].write(of, new)]
    return [folder / path.relative_to(new) for path in written]
