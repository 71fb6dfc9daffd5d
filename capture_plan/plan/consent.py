"""What was agreed about the likeness of a person, as a person wrote it: printed, kept in the plan, judged by nobody.

Only the day until which pictures are kept is read as one, so that it can be said when it has passed.
"""

import unicodedata
from datetime import date
from typing import Annotated

from msgspec import Meta, Struct

from capture_plan.errors import SettingsError

Words = Annotated[str, Meta(max_length=60)]  # a line of page one


class Consent(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the pictures of a face are for, who holds them, and the last day on which they are kept (YYYY-MM-DD); each
    may be empty."""

    purpose: Words = ""
    holder: Words = ""
    keep_until: Words = ""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if any(unicodedata.category(letter).startswith("C") for letter in getattr(self, name)):
                raise SettingsError(f"consent: '{name}' cannot be printed in one line: write it without breaks")
        if self.keep_until and _day(self.keep_until) is None:
            raise SettingsError(
                f"consent: keep_until is '{self.keep_until}': write a day of the calendar as YYYY-MM-DD, such as "
                '"2027-12-31", or leave it out'
            )


def _day(words: str) -> date | None:
    """The day that YYYY-MM-DD names; None for other words."""
    try:
        day = date.fromisoformat(words)
    except ValueError:
        return None
    return day if day.isoformat() == words else None  # weeks and days without dashes are ISO too, and read by few


def passed_words(consent: Consent, today: date) -> list[str]:
    """That the pictures were to be kept no longer than until a day that has passed; nothing on that day and before."""
    day = _day(consent.keep_until)
    if day is None or day >= today:
        return []
    return [f"note: consent: the pictures were to be kept until {day}, which has passed: ask before you go on"]


def consent_lines(consent: Consent) -> tuple[str, ...]:
    """'Purpose: …', 'Held by: …' and 'Keep until: …', those that were given."""
    said = {"Purpose": consent.purpose, "Held by": consent.holder, "Keep until": consent.keep_until}
    return tuple(f"{what}: {words}" for what, words in said.items() if words)
