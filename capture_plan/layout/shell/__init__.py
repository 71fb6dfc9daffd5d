"""Marker layouts for dense motion, chosen with a thin shell that the markers bend (Le et al. 2013)."""

from capture_plan.layout.shell.model import Shell

__all__ = ["Shell"]
