"""The plan itself with the JSON schema that describes it: `plan.json`, `plan.schema.json`."""

from pathlib import Path

from capture_plan.exports.delivery import Delivery
from capture_plan.output import write_whole
from capture_plan.plan.files import plan_schema, write_plan


def write(of: Delivery, folder: Path) -> list[Path]:
    """Write the plan and its schema."""
    schema = folder / "plan.schema.json"
    write_whole(schema, plan_schema())
    return [write_plan(of.plan, folder / "plan.json"), schema]
