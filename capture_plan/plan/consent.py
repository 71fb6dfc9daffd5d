"""What was agreed about the likeness of a person, as a person wrote it: printed, kept in the plan, judged by nobody."""

import unicodedata
from typing import Annotated

from msgspec import Meta, Struct

from capture_plan.errors import SettingsError

Words = Annotated[str, Meta(max_length=60)]  # a line of page one


class Consent(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the pictures of a face are for, who holds them and until when they are kept, each in words or empty."""

    purpose: Words = ""
    holder: Words = ""
    keep_until: Words = ""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if any(unicodedata.category(letter).startswith("C") for letter in getattr(self, name)):
                raise SettingsError(f"consent: '{name}' cannot be printed in one line: write it without breaks")


def consent_lines(consent: Consent) -> tuple[str, ...]:
    """'Purpose: …', 'Held by: …' and 'Keep until: …', those that were given."""
    said = {"Purpose": consent.purpose, "Held by": consent.holder, "Keep until": consent.keep_until}
    return tuple(f"{what}: {words}" for what, words in said.items() if words)
