"""Names that stand twice in one object of a JSON text, of which any reader sees the last alone.

Tokens    names (a text before a colon), and the brackets that open and close objects
Stack     the names of each object that is still open; one that is among them already stands twice
The first `MOST` characters are looked through: a program that writes a name twice does so in every frame. What is no
JSON finds nothing.
"""

import re

MOST = 20_000_000
TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"(\s*:)?|[{}]')


def names_twice(text: str) -> dict[str, int]:
    """How often a name stands in an object that has it already, in the order in which they are met."""
    found: dict[str, int] = {}
    open_objects: list[set[str]] = []
    for token in TOKEN.finditer(text, 0, MOST):
        if token[0] == "{":
            open_objects.append(set())
        elif token[0] == "}":
            open_objects = open_objects[:-1]
        elif token[2] and open_objects:
            name, names = token[1], open_objects[-1]
            if name in names:
                found[name] = found.get(name, 0) + 1
            names.add(name)
    return found


def message_of(text: str) -> tuple[str, ...]:
    """A sentence on names that stand twice; none where each stands once."""
    found = names_twice(text)
    if not found:
        return ()
    name, times = next(iter(found.items()))
    more = f" and {len(found) - 1:,} more" if len(found) > 1 else ""
    often = f" {times:,} times" if times > 1 else ""
    return (
        f"it is not certain which is meant: the name '{name}'{more} stands twice in one object{often}, and the last is "
        "read: export the take again with each name once",
    )
