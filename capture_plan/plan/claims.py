"""One thing that a plan says, whether it holds, and what was found."""

from dataclasses import dataclass

import numpy as np

TOLERANCE = 2e-4  # numbers in a plan carry four decimals


@dataclass(frozen=True)
class Claim:
    """One thing that a plan says, whether it holds, and what was found."""

    what: str
    holds: bool
    found: str


def claim(what: str, holds: bool | np.bool, found: str) -> Claim:
    """A claim from what NumPy compared."""
    return Claim(what, bool(holds), found)
