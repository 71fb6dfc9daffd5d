"""Which movement a blendshape's name says, in the words of the standards and languages that rigs are named in.

Name       "head__eyeBlink_L"   ->  words  head eye blink L   ->  things said {head, eye, close} and a side
Movement   the phrase of data/movements.toml that weighs most among those whose things are all said
Confidence 1 ARKit's own name; 0.9 every word is explained; less for each word that is not, and for one thing said alone

Words are matched whole: "browser" is no brow, "Hatch" no hat. A name is a hint; what moves, the geometry tells.

    movement_of("Fcl_EYE_Close_L")   blink, left
    movement_of("口角上げ")           smile
    movement_of("target_43")         None
    movement_of("A")                 None, but movements_of(["A", "I", "U", "E", "O"]) are five mouth shapes
"""

import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import Any, Literal, get_args

from capture_plan.names.arkit import INTENSITY, UNIT, Side, arkit_name
from capture_plan.names.tokens import DATA, side_words, split_words

_Kind = Literal[
    "blink", "eye wide", "eye squint", "gaze up", "gaze down", "gaze left", "gaze right", "gaze in", "gaze out",
    "brow up", "brow down", "jaw open", "jaw side", "jaw forward", "mouth open", "mouth close", "mouth narrow",
    "mouth wide", "smile", "frown", "mouth side", "lip up", "lip down", "lip roll", "lip press", "mouth other",
    "cheek", "nose", "tongue", "emotion", "neutral", "hide or shrink", "head turn", "body", "hair or clothes",
    "teeth", "pupil",
]  # fmt: skip
Phrase = tuple[float, _Kind, tuple[str, ...]]  # weight, kind, the things it needs
_Sides = list[tuple[int, Side]]  # where in a name a word for left or right stands
KINDS: tuple[_Kind, ...] = get_args(_Kind)
SIDEWAYS = ("jaw side", "mouth side", "head turn", "tongue")  # their left is a direction, no half of the face
OBJECTS = frozenset(
    ("hide or shrink", "hair or clothes", "body", "cheek", "nose", "tongue", "teeth", "pupil")
)  # however they move
PARTS = frozenset(("eye", "lid", "brow", "mouth", "lip", "corner", "jaw", "cheek", "nose", "tongue"))
OWN, UNIT_NAME, PLAIN, ONE_THING = 1.0, 0.95, 0.9, 0.8
UNEXPLAINED, STRANGE = 0.15, 0.15  # taken off for a known thing that is no part of the movement, for an unknown word
VOWELS = frozenset(("a", "i", "u", "e", "o", "aa", "ih", "ou", "ee", "oh", "ah", "uh", "oo"))
SURE = 0.75  # below it a name says something besides the movement
SYLLABLE = 0.6  # one kana or hangul, alone in its rig
PREFIXED = 0.95  # of a movement read after a prefix was cut off
MMD_LEAST = 3  # standard names of MikuMikuDance in one rig
SHARED = 0.6  # of the names open with the same words: a prefix


@dataclass(frozen=True)
class Movement:
    """What a name says: the `kind` of movement, the half of the face (`side`), a confidence from 0 to 1.

    `towards` is where a jaw, mouth, tongue or head moves to, the subject's own left or right; gaze has kinds for that.
    `nearest` are ARKit's blendshapes where the name says more than its kind; `part` is the lip that it says besides.
    """

    kind: _Kind
    side: Side | None = None
    confidence: float = PLAIN
    towards: Side | None = None
    nearest: str | None = None
    part: Literal["upper", "lower"] | None = None


@lru_cache(maxsize=8192)
def movement_of(name: str) -> Movement | None:
    """What one name says by itself; None where it says nothing of a movement."""
    ways = [(_read(name), 1.0)]
    for mark in ".:|/":
        rest = name.rpartition(mark)[2]
        if rest != name and rest[:1].isalpha():
            ways.append((_read(rest), PREFIXED))
    return _surest(ways)


def movements_of(names: Sequence[str]) -> tuple[Movement | None, ...]:
    """What each name says beside the others: visemes of one letter, names of MikuMikuDance, a prefix that all share."""
    words = [split_words(name) for name in names]
    prefix = _shared_prefix(words)
    short = [tuple(w[len(prefix) :]) if _is_cut(w, prefix) else tuple(w) for w in words]
    quarters = _quarters(words)
    messages = [_better_of(movement_of(name), _said(w)) for name, w in zip(names, short, strict=True)]
    messages = [_in_quarter(tuple(w), found, quarters) for w, found in zip(words, messages, strict=True)]
    family = _families(short)
    messages = [_in_family(w, found, family) for w, found in zip(short, messages, strict=True)]
    if sum(_bare(w) in _table("mmd") for w in short) >= MMD_LEAST:
        messages = [_in_mmd(w, found) for w, found in zip(short, messages, strict=True)]
    return tuple(_winks(words, messages))


def nearest_of(movement: Movement) -> tuple[str, ...]:
    """ARKit's blendshapes nearest to a movement, without a side; none where none is or the name is not sure."""
    bases = _table("nearest").get(movement.kind, "") if movement.nearest is None else movement.nearest
    if movement.confidence < SURE:
        return ()
    if movement.kind in SIDEWAYS:
        return (f"{bases}{movement.towards.capitalize()}",) if bases and movement.towards else ()
    return tuple(bases.split())


def says(name: str) -> frozenset[str]:
    """The things that the words of a name say: eye and open of EyeOpenLeft."""
    return frozenset(thing for word in split_words(name) for thing in _meanings().get(word, ()))


def said_of(movement: Movement) -> str:
    """A movement in words for people: "smile (left)"."""
    words = _table("said").get(movement.kind, movement.kind)
    return f"{words} ({movement.side})" if movement.side else words


def _better_of(whole: Movement | None, cut: Movement | None) -> Movement | None:
    """Of a whole name and what follows its prefix the surer reading; a hat or a body as prefix says nothing."""
    if cut and whole and whole.kind in ("hair or clothes", "body"):
        return cut
    return _surest([(whole, 1.0), (cut, PREFIXED)])


def _surest(ways: list[tuple[Movement | None, float]]) -> Movement | None:
    found = [replace(one, confidence=round(one.confidence * share, 3)) for one, share in ways if one]
    return max(found, key=lambda one: one.confidence, default=None)


def _read(name: str) -> Movement | None:
    """A name as ARKit's, as an action unit, or by its words."""
    if known := arkit_name(name):
        return _arkit(known)
    match = UNIT.fullmatch(name)
    if match and (kind := _table("facs").get(f"AU{int(match['number'])}")):
        letter = "" if INTENSITY.fullmatch(name) else (match["side"] or match["before"] or "").lower()[:1]
        side: Side | None = "left" if letter == "l" else "right" if letter == "r" else None
        return Movement(kind, side, UNIT_NAME)
    return _said(tuple(split_words(name)))


def _arkit(known: str) -> Movement:
    table = _table("arkit")
    if known in table:
        towards: Side | None = "left" if known.endswith("Left") else "right" if known.endswith("Right") else None
        return Movement(table[known], None, OWN, towards)
    side: Side = "left" if known.endswith("Left") else "right"
    return Movement(table[known.removesuffix("Left").removesuffix("Right")], side, OWN)


@lru_cache(maxsize=8192)
def _said(words: tuple[str, ...]) -> Movement | None:
    """The movement that words say together."""
    if found := _sound(words):
        return found
    meanings = _meanings()
    things = [meanings.get(word) for word in words]
    if whole := meanings.get("".join(word for word in words if word not in side_words())):
        things = [whole]
    said = {thing for each in things for thing in each or ()}
    sides: _Sides = [
        (at, side) for at, word in enumerate(words) if (side := side_words().get(word)) and word not in meanings
    ]
    if sides:
        said.add("side")
    phrase = _heaviest(frozenset(said))
    if phrase is None and said == {"eye", "side"} and (len(sides) > 1 or "eyes" in words):
        phrase = ("gaze left", ("eye", "side"))
    if phrase is None:
        return None
    kind, used = phrase
    first = next((at for at, each in enumerate(things) if each), 0)
    strange = [at for at, (word, each) in enumerate(zip(words, things, strict=False)) if not each and _is_strange(word)]
    left = kind not in OBJECTS and said - set(used) - {
        "side",
        "head",
        "face",
        "torso",
        "upper",
        "lower",
        "inner",
        "outer",
    }
    sure = (PLAIN if len(used) > 1 else ONE_THING) - UNEXPLAINED * bool(left)
    sure -= STRANGE * any(at > first for at in strange) + STRANGE / 3 * any(at < first for at in strange)
    return replace(_sided(kind, round(sure, 3), sides, words), nearest=_finer(kind, said))


def _finer(kind: _Kind, said: set[str]) -> str | None:
    """ARKit's blendshapes of a name that says more than its kind."""
    entries = _table("nearest_of").get(kind, {})
    fits = [needs for needs in entries if said.issuperset(needs.split())]
    return entries[max(fits, key=lambda needs: len(needs.split()))] if fits else None


def _sound(words: tuple[str, ...]) -> Movement | None:
    """A mouth shape by the sound that stands after a word for viseme or mouth, or by a syllable."""
    plain = [word for word in words if not word.isdigit()]
    syllables, meanings = _by_name("syllables"), _meanings()
    if plain and plain[-1] in syllables and all(meanings.get(word) in (("mouth",), ("viseme",)) for word in plain[:-1]):
        return Movement(syllables[plain[-1]], None, SYLLABLE if len(plain) == 1 else PLAIN)
    for at, word in enumerate(plain[:-1]):
        rest = " ".join(plain[at + 1 :])
        meaning = meanings.get(word)
        spoken = meaning == ("viseme",) or (meaning == ("mouth",) and rest in VOWELS)
        if spoken and (kind := _by_name("sounds").get(rest)):
            return Movement(kind, None, PLAIN)
    return None


def _heaviest(said: frozenset[str]) -> tuple[_Kind, tuple[str, ...]] | None:
    """The phrase of which everything is said and that weighs most, and its kind."""
    parts = said & PARTS
    fits: list[Phrase] = [(weight, kind, used) for weight, kind, used in _phrases() if said.issuperset(used)]
    fits = [fit for fit in fits if not (parts and fit[1] == "emotion")]
    heaviest = max(fits, key=lambda fit: fit[0], default=None)
    return (heaviest[1], heaviest[2]) if heaviest else None


def _sided(kind: _Kind, sure: float, sides: _Sides, words: tuple[str, ...]) -> Movement:
    """The movement with its side, or with where it goes to."""
    if kind == "gaze left":
        look = next((at for at, word in enumerate(words) if "look" in (_meanings().get(word) or ())), None)
        goes = next((one for one in sides if look is not None and one[0] > look), sides[-1])
        half: Side | None = next((side for one, side in sides if one != goes[0]), None)
        return Movement("gaze left" if goes[1] == "left" else "gaze right", half, sure)
    if kind in SIDEWAYS and sides:
        return Movement(kind, sides[0][1] if len(sides) > 1 else None, sure, sides[-1][1])
    one = {side for _, side in sides}
    half = sides[0][1] if len(one) == 1 else None
    return Movement(kind, half, sure)


def _shared_prefix(words: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Words that most names open with."""
    prefix: tuple[str, ...] = ()
    while len(words) > 2:
        longer = Counter(tuple(w[: len(prefix) + 1]) for w in words if len(w) > len(prefix) + 1)
        longer = Counter({key: n for key, n in longer.items() if key[:-1] == prefix})
        if not longer or longer.most_common(1)[0][1] < SHARED * len(words):
            return prefix
        prefix = longer.most_common(1)[0][0]
    return prefix


def _is_cut(words: Sequence[str], prefix: tuple[str, ...]) -> bool:
    """Whether a name opens with the prefix and says something in letters after it."""
    n = len(prefix)
    return 0 < n < len(words) and tuple(words[:n]) == prefix and not words[n].isdigit()


def _quarters(words: Sequence[Sequence[str]]) -> frozenset[tuple[str, ...]]:
    """Names, as words without their last, of which several ends are there, a lower one among them: LT beside LB."""
    ends: dict[tuple[str, ...], set[str]] = {}
    for w in words:
        if len(w) > 1 and w[-1] in _table("quarters"):
            ends.setdefault(tuple(w[:-1]), set()).add(w[-1])
    families = ({"lt", "lb", "rt", "rb"}, {"t", "b"})
    several = ((rest, family & found) for rest, found in ends.items() for family in families)
    return frozenset(rest for rest, found in several if len(found) > 1 and any(end.endswith("b") for end in found))


def _in_quarter(
    words: tuple[str, ...], found: Movement | None, quarters: frozenset[tuple[str, ...]]
) -> Movement | None:
    """A name that ends in LT, RB, T or B beside its other ends, read with the side and the lip that these say."""
    if words[:-1] not in quarters or words[-1] not in _table("quarters"):
        return found
    end = _table("quarters")[words[-1]].split()
    message = _said((*words[:-1], *end))
    return replace(message, part=end[-1]) if message else found


def _bare(words: Sequence[str]) -> str:
    """A name without sides and numbers, its words with spaces."""
    return " ".join(word for word in words if not word.isdigit() and word not in side_words())


def _families(words: Sequence[tuple[str, ...]]) -> frozenset[str]:
    """Short names that mean something here, because enough others of their family are there."""
    here = {" ".join(word for word in w if not word.isdigit()) for w in words}
    if len(here & set("bcdfg")) > 2:
        return frozenset()  # letters of the alphabet, counted
    families = [frozenset(one["names"]) for one in _data()["families"] if len(here & set(one["names"])) >= one["least"]]
    return frozenset().union(*families)


def _in_family(words: tuple[str, ...], found: Movement | None, family: frozenset[str]) -> Movement | None:
    plain = [word for word in words if not word.isdigit()]
    if " ".join(plain) in family and (kind := _by_name("sounds").get(" ".join(plain))):
        return Movement(kind, None, PLAIN)
    return found


def _in_mmd(words: tuple[str, ...], found: Movement | None) -> Movement | None:
    """What a name of MikuMikuDance moves; its kana stand for mouth shapes beyond doubt."""
    side: Side | None = next((side_words()[word] for word in words if word in side_words()), None)
    if kind := _table("mmd").get(_bare(words)):
        return Movement(kind, side, PLAIN)
    return replace(found, confidence=PLAIN) if found and found.confidence == SYLLABLE else found


def _winks(words: Sequence[Sequence[str]], messages: list[Movement | None]) -> list[Movement | None]:
    """A wink without a side is the other one of a wink that has a side: ウィンク beside ウィンク右 is the left."""
    sided: dict[str, set[Side]] = {}
    for w, one in zip(words, messages, strict=True):
        if one and one.kind == "blink" and one.side:
            sided.setdefault(_bare(w), set()).add(one.side)
    other: dict[Side, Side] = {"left": "right", "right": "left"}
    for k, (w, one) in enumerate(zip(words, messages, strict=True)):
        halves = sided.get(_bare(w), set())
        is_wink = _bare(w).replace("ウインク", "ウィンク").split(" ")[-1] in ("ウィンク", "wink")
        if one and one.side is None and is_wink and len(halves) == 1:
            messages[k] = replace(one, side=other[next(iter(halves))])
    return messages


def _is_strange(word: str) -> bool:
    """A word that nothing here knows."""
    return not (word.isdigit() or len(word) == 1 or word in side_words() or word in _filler())


@cache
def _data() -> dict:
    return tomllib.loads(DATA.read_text(encoding="utf-8"))


def _table(key: str) -> dict[str, Any]:
    return _data()[key]


@cache
def _by_name(key: str) -> dict[str, _Kind]:
    """A table of kinds turned round: the kind of every name in it."""
    return {name: kind for kind, names in reversed(_data()[key].items()) for name in names}


@cache
def _meanings() -> dict[str, tuple[str, ...]]:
    """What every word says."""
    return {word: tuple(said.split()) for said, words in _data()["words"].items() for word in words}


@cache
def _filler() -> frozenset[str]:
    return frozenset(_data()["filler"]["words"])


@cache
def _phrases() -> tuple[Phrase, ...]:
    """Weight, kind and things of every phrase, in the order of the file."""
    weights = _data()["weights"]
    phrases: Iterator[Phrase] = (
        (float(sum(weights.get(thing, 1.0) for thing in phrase.split())), kind, tuple(phrase.split()))
        for kind, some in _data()["kinds"].items()
        for phrase in some
    )
    return tuple(phrases)
