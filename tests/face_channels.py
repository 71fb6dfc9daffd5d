"""What a file does with a head of `face_heads.py`: its set of blendshapes, where it lies, how things are named."""

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tests.face_heads import Head, add, bend, between, hatted, ring, tube

SEVEN = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", "mouthSmileRight", "browInnerUp", "mouthPucker")
EMOTIONS = {
    "Joy": "mouthSmileLeft mouthSmileRight eyeSquintLeft eyeSquintRight cheekSquintLeft cheekSquintRight jawOpen",
    "Angry": "browDownLeft browDownRight noseSneerLeft noseSneerRight mouthFrownLeft mouthFrownRight eyeSquintLeft",
    "Sorrow": "browInnerUp mouthFrownLeft mouthFrownRight eyeBlinkLeft eyeBlinkRight mouthShrugLower",
    "Fun": "mouthSmileLeft mouthSmileRight browOuterUpLeft browOuterUpRight eyeBlinkLeft eyeBlinkRight",
    "Surprised": "jawOpen eyeWideLeft eyeWideRight browInnerUp browOuterUpLeft browOuterUpRight",
}
VOWELS = {
    "A": "jawOpen",
    "I": "mouthStretchLeft mouthStretchRight mouthSmileLeft mouthSmileRight",
    "U": "mouthPucker",
    "E": "mouthStretchLeft mouthStretchRight mouthLowerDownLeft mouthLowerDownRight",
    "O": "mouthFunnel jawOpen",
    "Blink": "eyeBlinkLeft eyeBlinkRight",
    "Blink_L": "eyeBlinkLeft",
    "Blink_R": "eyeBlinkRight",
}
JAPANESE = {
    "Blink": "まばたき",
    "eyeBlinkLeft": "ウィンク左",
    "eyeBlinkRight": "ウィンク右",
    "Blink_L": "ウィンク",
    "Blink_R": "ウィンク右",
    "jawOpen": "あ",
    "A": "あ",
    "I": "い",
    "U": "う",
    "E": "え",
    "O": "お",
    "mouthPucker": "う",
    "mouthFunnel": "お",
    "browInnerUp": "困る",
    "Joy": "笑い",
    "Angry": "怒り",
    "Sorrow": "悲しむ",
    "Fun": "にこり",
    "Surprised": "びっくり",
    "tongueOut": "べー",
}
PARTS = {"skin": "顔", "eye_L": "左目", "eye_R": "右目", "tongue": "舌", "hat": "帽子", "hair": "髪", "body": "体"}


def full(head: Head) -> Head:
    """ARKit's 52."""
    return head


def seven(head: Head) -> Head:
    """A few channels only."""
    return _sums(head, {name: name for name in SEVEN})


def emotions(head: Head) -> Head:
    """Emotions of the whole face alone."""
    return _sums(head, EMOTIONS)


def vowels(head: Head) -> Head:
    """VRM's vowels, blinks and emotions."""
    return _sums(head, VOWELS | EMOTIONS)


def hidden_hat(head: Head) -> Head:
    """A hat and a blendshape that draws it into the head."""
    head = hatted(head)
    hat = head.of("hat")
    return _one_more(head, "Hide_hat", np.where(hat[:, None], [0.0, 720, 60] - head.neutral, 0))


def turning(head: Head) -> Head:
    """Blendshapes that turn and nod the whole head about the neck."""
    x, y, z = (head.neutral - [0, 640, 30]).T
    share = np.clip((head.neutral[:, 1] - 590) / 60, 0, 1)[:, None]
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    turned = np.stack([c * x + s * z, y, c * z - s * x], axis=1)
    nodded = np.stack([x, c * y - s * z, c * z + s * y], axis=1)
    still = np.stack([x, y, z], axis=1)
    head = _one_more(head, "head_turn_left", share * (turned - still))
    return _one_more(head, "head_nod", share * (nodded - still))


def breathing(head: Head) -> Head:
    """A chest of its own and a blendshape that lifts it."""
    shape = [ring(62, 58, 592), ring(120, 75, 555), ring(185, 95, 520), ring(180, 105, 380)]
    head = add(head, tube(between(shape)), "chest")
    lift = np.clip((560 - head.neutral[:, 1]) / 100, 0, 1) * (head.neutral[:, 2] > 60) * head.of("chest")
    return _one_more(head, "chest_breath", lift[:, None] * [0.0, 12, 55])


def fitting(head: Head) -> Head:
    """A shirt of its own and blendshapes that fit it to two bodies, further than anything moves in the face."""
    shape = [ring(75, 65, 615), ring(125, 80, 560), ring(190, 100, 520), ring(190, 110, 150)]
    head = add(head, tube(between(shape)), "shirt_to_fit")
    shirt = head.of("shirt_to_fit")[:, None]
    wide = shirt * (head.neutral - [0, 400, 33]) * [0.3, 0, 0.3]
    return _one_more(_one_more(head, "male", wide), "female", -wide + shirt * [0.0, -15, 0])


CHANNELS: dict[str, Callable[[Head], Head]] = {
    kind.__name__: kind for kind in (full, seven, emotions, vowels, hidden_hat, turning, breathing, fitting)
}


def _sums(head: Head, wanted: dict[str, str]) -> Head:
    """Blendshapes that are sums of the head's own; what the head lacks adds nothing, empty sums are left out."""
    sums = {
        name: sum((head.deltas[head.names.index(one)] for one in of.split() if one in head.names), np.float32(0))
        for name, of in wanted.items()
    }
    sums = {name: delta for name, delta in sums.items() if np.any(delta)}
    return replace(head, deltas=np.stack(list(sums.values())), names=tuple(sums))


def _one_more(head: Head, name: str, delta: np.ndarray) -> Head:
    deltas = np.concatenate([head.deltas, delta[None].astype(np.float32)])
    return replace(head, deltas=deltas, names=(*head.names, name))


# ---------------------------------------------------------------- where and how a head lies in its file
def at_home(head: Head, rng: random.Random) -> Head:
    """As it was made: the midline at x = 0."""
    return head


def shifted(head: Head, rng: random.Random) -> Head:
    """Somewhere else, its midline too."""
    by = np.array([rng.uniform(-700, 700) for _ in "xyz"])
    return replace(bend(head, lambda v: v + by), deltas=head.deltas)


def renumbered(head: Head, rng: random.Random) -> Head:
    """Vertices in an order that says nothing."""
    order = np.random.default_rng(rng.randrange(2**32)).permutation(len(head.neutral))
    triangles = np.argsort(order)[head.triangles].astype(np.int32)
    arrays = {"neutral": head.neutral[order], "deltas": head.deltas[:, order], "parts": head.parts[order]}
    return replace(head, triangles=triangles, **arrays)


def smaller(head: Head, rng: random.Random) -> Head:
    """A person whose pupils are 54 mm apart."""
    return replace(bend(head, lambda v: 0.94 * v), eye_depth=0.94 * head.eye_depth)


def larger(head: Head, rng: random.Random) -> Head:
    """A person whose pupils are 64 mm apart."""
    return replace(bend(head, lambda v: 1.1 * v), eye_depth=1.1 * head.eye_depth)


PLACINGS: dict[str, Callable[[Head, random.Random], Head]] = {
    kind.__name__: kind for kind in (at_home, shifted, renumbered, smaller, larger)
}


# ---------------------------------------------------------------- names
def as_named(head: Head, rng: random.Random) -> Head:
    """Names as they are."""
    return head


def prefixed(head: Head, rng: random.Random) -> Head:
    """Names behind the name of a node."""
    before = rng.choice(("head_geo.Face_", "Face.M_F00_", "blendShape1.", "CC_Base_Body."))
    parts = tuple(f"avatar:{name}_geo" for name in head.part_names)
    return replace(head, names=tuple(before + name for name in head.names), part_names=parts)


def japanese(head: Head, rng: random.Random) -> Head:
    """Names in Japanese; those without a usual one are numbered."""
    names = tuple(JAPANESE.get(name, f"表情{i:02d}") for i, name in enumerate(head.names))
    return replace(head, names=names, part_names=tuple(PARTS.get(n, f"材質{i}") for i, n in enumerate(head.part_names)))


def removed(head: Head, rng: random.Random) -> Head:
    """Numbers for names, in another order."""
    order = rng.sample(range(len(head.names)), len(head.names))
    names = tuple(f"shape_{i:02d}" for i in range(len(order)))
    parts = tuple(f"mesh_{i}" for i in range(len(head.part_names)))
    return replace(head, deltas=head.deltas[order], names=names, part_names=parts)


NAMINGS: dict[str, Callable[[Head, random.Random], Head]] = {
    kind.__name__: kind for kind in (as_named, prefixed, japanese, removed)
}
