"""What a part of a head is, by its name: a mesh, a material or a group as whoever made the rig called it.

The first kind whose words a name holds is its kind, so what is worn comes before what it is worn on ('eyeglasses',
'beard', 'necklace'), and what lies on an eye before the eye. Skin finding, printed sheets and the page all ask here;
each only says what it does with a kind. Names are a help: a part without a telling name is recognised by its shape.
"""

import re
from functools import cache
from typing import Literal, get_args

PartKind = Literal[
    "glasses", "clear", "lash", "eye line", "brow", "hair", "teeth", "tongue", "gums", "inside", "iris", "eye",
    "clothes", "skin", "body", "other",
]  # fmt: skip
PART_KINDS = get_args(PartKind)
PART_WORDS: tuple[tuple[PartKind, str], ...] = (
    ("glasses", r"glass|goggle|eyewear"),
    # shells and fluids over an eye, and the corner of an eye
    (
        "clear",
        r"occlusion|lacrimal|caruncle|cartilage|tear|fluid|wetness|moisture|saliva|cornea|lens"
        r"|eye.?(blend|shell|edge|highlight|reflection|trans)",
    ),
    ("lash", r"lash|cilia"),
    ("eye line", r"eye.?line"),
    ("brow", r"brow(?!n)"),
    ("hair", r"hair|beard|m(o|u|ou)stache|stubble|goatee|fuzz|fur(?!n)"),
    ("teeth", r"teeth|tooth|dentur|dental"),
    ("tongue", r"tongue"),
    ("gums", r"gum"),
    ("inside", r"mouth.?(bag|sock|cav|in)|eye.?sock|(?<![a-z])oral|palate"),
    ("iris", r"iris|pupil"),
    ("eye", r"eye(?!_?-? ?lid)|sclera"),
    (
        "clothes",  # and whatever else is worn; 'genital' is a helper of MakeHuman's for clothes
        r"wear|hat(?!ch)|cap$|beanie|hood|scarf|veil|turban|bonnet|helmet|head(gear|band|phone|set|dress|piece)|horn"
        r"|antler|cloth|outfit|shirt|jacket|collar|suit|dress|coat|pants|trouser|skirt|tights|shoe|glove|genital|armou?r"
        r"|jewel|earring|necklace",
    ),
    ("skin", r"skin|face|head|neck|(?<!g)ear|scalp|lip|eye.?lid"),
    ("body", r"body"),
)
NOT_SKIN: frozenset[PartKind] = frozenset(PART_KINDS) - {"skin", "body", "other"}
# On skin, and does not hide it from make-up.
WORN: frozenset[PartKind] = frozenset({"glasses", "clear", "lash", "hair", "clothes"})
DRAWN: frozenset[PartKind] = frozenset({"brow", "eye line"})  # on skin


@cache
def part_kind(name: str) -> PartKind:
    """What a part of this name is; 'other' where the name says nothing."""
    for kind, words in PART_WORDS:
        if re.search(words, name, re.IGNORECASE):
            return kind
    return "other"
