"""One thing that a plan says, whether it holds, and what was found."""

from dataclasses import dataclass

import numpy as np

TOLERANCE = 2e-4  # numbers in a plan carry four decimals
CHANGED = "the plan, or a file it was made from, has changed since, or another version made it: plan again"


@dataclass(frozen=True)
class Claim:
    """One thing that a plan says, whether it holds, and what was found; `mend` is what to correct where it does not."""

    what: str
    holds: bool
    found: str
    mend: str = ""

    @property
    def explanation(self) -> str:
        """What was found and what to correct, in one line."""
        return f"{self.found}: {self.mend}" if self.mend else self.found


def claim(what: str, holds: bool | np.bool, found: str, mend: str = "") -> Claim:
    """A claim from what NumPy compared; `mend` is left out where it holds."""
    return Claim(what, bool(holds), found, "" if holds else mend)
