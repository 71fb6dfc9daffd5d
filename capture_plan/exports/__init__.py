"""What other programs read."""

from capture_plan.exports.expression_meshes import write_expression_meshes
from capture_plan.exports.slate import write_slate
from capture_plan.exports.tables import write_schema, write_tables
from capture_plan.exports.verify import write_verifier

__all__ = ["WRITES", "write_expression_meshes", "write_schema", "write_slate", "write_tables", "write_verifier"]

WRITES = (
    *("plan.html", "plan.json", "plan.schema.json", "rig.npz", "verify_plan.py", "expressions", "expressions-DRAFT"),
    *(f"{name}{draft}.csv" for name in ("landmarks", "expressions", "slate") for draft in ("", "-DRAFT")),
)  # files and folders, all there can be
