"""The plan as one HTML file that opens without a network, and the 3D head for notebooks."""

from capture_plan.report.page import viewer_html, write_html

__all__ = ["viewer_html", "write_html"]
