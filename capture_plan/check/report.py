"""What a check found, for a person: what to correct with the claims that fail for it, and one line for all that hold.

What no check can recompute is said too, so that "holds" is never taken for more than it is.
"""

from collections.abc import Sequence

from capture_plan.plan.claims import CHANGED, Claim


def check_lines(claims: Sequence[Claim], unchecked: Sequence[str], *, every: bool = False) -> list[str]:
    """The page: failing claims by what to correct; with `every`, a line for each claim in the order of the check."""
    holding = sum(claim.holds for claim in claims)
    number = f"{holding} of {len(claims)} claims" if holding < len(claims) else f"All {len(claims)} claims"
    lines = [_line(claim) for claim in claims] if every else _by_correction(claims)
    message = f"{number} hold." if every or not holding else f"{number} hold; --all lists each."
    return [*lines, message, *(f"Not checked: {what}." for what in unchecked)]


def as_rows(claims: Sequence[Claim]) -> list[dict[str, str | bool]]:
    """The claims for programs: what, whether it holds, what was found with what to correct."""
    return [{"what": claim.what, "holds": claim.holds, "found": claim.explanation} for claim in claims]


def _line(claim: Claim) -> str:
    return f"{'holds ' if claim.holds else 'FAILS '} {claim.what}: {claim.explanation}"


def _by_correction(claims: Sequence[Claim]) -> list[str]:
    """Every correction once, below it the claims that fail for it."""
    failing: dict[str, list[Claim]] = {}
    for claim in claims:
        if not claim.holds:
            failing.setdefault(claim.mend or CHANGED, []).append(claim)
    lines = []
    for mend, several in failing.items():
        lines.append(f"To correct: {mend}.")
        lines += [f"  FAILS  {claim.what}: {claim.found}" for claim in several]
    return lines
