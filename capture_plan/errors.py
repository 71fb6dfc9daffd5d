"""The ways a plan can fail, each a line that says what was found, what was expected and what to change."""

LONGEST, END = 1500, 400  # signs of a message, and of its end, where the advice stands


class CapturePlanError(Exception):
    """What the command line turns into one line and exit code 2; what a file smuggles in stays harmless to a screen."""

    def __init__(self, message: str) -> None:
        fits = len(message) <= LONGEST
        super().__init__(printable(message if fits else f"{message[: LONGEST - END]} ... {message[-END:]}"))


def printable(text: str) -> str:
    """The text with a sign in place of whatever a terminal would obey."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


class RigError(CapturePlanError):
    """What was given is not a usable rig, sequence or camera file."""


class PlanError(CapturePlanError):
    """A plan file is unreadable, or does not fit its rig, or cannot be written."""


class SettingsError(PlanError, ValueError):
    """Settings that contradict each other or lie out of range, in a file or in Python."""


class InfeasibleError(CapturePlanError):
    """No plan satisfies these settings."""
