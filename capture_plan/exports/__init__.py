"""What other programs read."""

from capture_plan.exports.tables import write_schema, write_tables

__all__ = ["write_schema", "write_tables"]
