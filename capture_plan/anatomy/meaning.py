"""What a blendshape does in ARKit's words, as its name says and its motion confirms: eyeBlinkLeft, jawRight.

Rule   what moves a name says; which side and which way the motion says, where it is clear:
       gaze        a name of in or out, or no known name, follows the eye that turns and its way (`gaze.py`); where no
                   eye is seen to turn, lids that go the other way than the name says exchange up and down, in and out
       sided       Left and Right are exchanged where three quarters of the movement lie on the other side
       direction   jawLeft and jawRight are exchanged where the skin moves the other way
       jaw         words such as "mouth open" are no jawOpen where the chin stays behind and only lips part
       unclear     the name stands; what was exported wrongly does nothing that could be said
The subject's own sides throughout; a rig whose names are the viewer's sides is told by its motion.
"""

import numpy as np

from capture_plan.anatomy.agreement import agreed_meanings
from capture_plan.anatomy.blendshape_pairs import ONE_SIDED, laterality
from capture_plan.anatomy.gaze import Gaze, gazes
from capture_plan.anatomy.regions import face_regions
from capture_plan.face.misexported import misexported
from capture_plan.face.reading import face_reading
from capture_plan.names.arkit import DIRECTIONS, base_name
from capture_plan.names.recognise import IN_WORDS, Recognised
from capture_plan.once import once
from capture_plan.rig import Rig

OF_PARTS = ("MetaHuman", "VRM", "MB-Lab")  # whose names say a part of a movement, or several at once
OF_ONE_MIND = 0.5  # of the movement goes that way: jaws moved aside have 0.84 to 0.99, mouths 0.75 to 0.89
CHIN_ALONG = 0.4  # of the largest motion goes half of a chin under an open jaw: 0.76 to 0.97; under parted lips 0.14
OTHER = {"Left": "Right", "Right": "Left", "Up": "Down", "Down": "Up", "In": "Out", "Out": "In"}
LOOK = "eyeLook"


def arkit_by_motion(rig: Rig, name: str) -> str | None:
    """ARKit's name for what blendshape `name` does; None where neither its name nor its motion tells."""
    return _all(rig)[name]


def other_ways(rig: Rig) -> dict[str, tuple[str, str]]:
    """The way that a name says and the opposite one that its eye, jaw or mouth goes: ("Up", "Down"), by name."""
    means = agreed_meanings(rig)
    pairs = {name: (said, does) for name, does in _all(rig).items() if does and (said := _said(means[name]))}
    ways = {name: (_way(said), _way(does)) for name, (said, does) in pairs.items() if said != does}
    return {name: (said, does) for name, (said, does) in ways.items() if said and does and OTHER[said] == does}


@once
def _all(rig: Rig) -> dict[str, str | None]:
    looks, side = gazes(rig), dict(zip(rig.names, laterality(rig).tolist(), strict=True))
    meant = agreed_meanings(rig)
    said = {name: _said(meaning) for name, meaning in meant.items()}
    opened = [name for name, arkit in said.items() if arkit == "jawOpen" and _in_words(meant[name])]
    said |= dict.fromkeys(_lips_alone(rig, opened))
    turned = set(face_reading(rig).sides.disagree) - {name for name, _ in rig.meanings}
    looks = {name: gaze for name, gaze in looks.items() if _may_look(meant[name])}
    wrong = {one.name for one in misexported(rig)}
    return {
        name: None if name in wrong else _confirmed(rig, name, said[name], looks.get(name), side[name], name in turned)
        for name in rig.names
    }


def _said(meaning: Recognised | None) -> str | None:
    """ARKit's name for a name that says exactly one movement."""
    one = meaning is not None and len(meaning.arkit) == 1 and meaning.standard not in OF_PARTS and not meaning.part
    return meaning.arkit[0] if meaning and one else None


def _may_look(meaning: Recognised | None) -> bool:
    """Whether a name says a look or nothing: eyes that turn under lids that close are no look."""
    return meaning is None or not meaning.arkit or any(arkit.startswith(LOOK) for arkit in meaning.arkit)


def _in_words(meaning: Recognised | None) -> bool:
    return meaning is not None and meaning.standard == IN_WORDS


def _lips_alone(rig: Rig, names: list[str]) -> list[str]:
    """Of blendshapes that open the mouth by their names those whose chin stays behind."""
    regions = face_regions(rig) if names else None
    if regions is None or not regions.known:
        return []
    chin = (regions.of_vertex == regions.names.index("chin")) & rig.skin
    length = {name: np.where(rig.skin, rig.displacement[rig.names.index(name)], 0) for name in names}
    return [name for name, far in length.items() if chin.any() and np.median(far[chin]) < CHIN_ALONG * far.max()]


def _confirmed(rig: Rig, name: str, said: str | None, gaze: Gaze | None, side: float, turned: bool) -> str | None:
    """What a blendshape does of which the name says `said`; `turned` where it goes the other way or side than that."""
    if gaze is not None and gaze.eye and (said is None or said.startswith(LOOK)):
        return _look(gaze)
    if said is None:
        return None
    if said in DIRECTIONS:
        aside = _aside(rig, name)
        moves = "Left" if aside > 0 else "Right"
        return _exchanged(said) if not said.endswith(moves) and (turned or abs(aside) >= OF_ONE_MIND) else said
    if said.startswith(LOOK):
        return _turned(said) if turned else said
    moves = "Left" if side > 0 else "Right"
    message = base_name(said) == said or said.endswith(moves) or abs(side) < ONE_SIDED
    return said if message else _exchanged(said)


def _look(gaze: Gaze) -> str:
    side = "Left" if gaze.eye > 0 else "Right"
    if gaze.way in ("up", "down"):
        return f"eyeLook{gaze.way.capitalize()}{side}"
    return f"eyeLook{'Out' if gaze.way == side.lower() else 'In'}{side}"


def _way(arkit: str) -> str | None:
    """Where an eye, a jaw or a mouth goes by ARKit's name; None for a name that says no way."""
    if arkit.startswith(LOOK):
        return base_name(arkit).removeprefix(LOOK)
    return next((way for way in ("Left", "Right") if arkit in DIRECTIONS and arkit.endswith(way)), None)


def _turned(look: str) -> str:
    """The same eye's look the other way."""
    way = base_name(look).removeprefix(LOOK)
    return LOOK + OTHER[way] + look.removeprefix(LOOK + way)


def _exchanged(arkit: str) -> str:
    word = "Left" if arkit.endswith("Left") else "Right"
    return arkit.removesuffix(word) + OTHER[word]


def _aside(rig: Rig, name: str) -> float:
    """Mean of the movement's direction to the subject's left, from 1 to -1, as the skin moves."""
    k = rig.names.index(name)
    length = np.where(rig.skin, rig.displacement[k], 0).astype(float)
    # sum |d|^2 (d_x / |d|) / sum |d|^2
    return float(length @ rig.deltas[k, :, 0] / max(float((length**2).sum()), 1e-12))
