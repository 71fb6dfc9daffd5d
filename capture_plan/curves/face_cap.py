"""Face Cap's recordings as text: one line for each frame, in milliseconds, angles in degrees.

info,...                                    about the recording
bs,browInnerUp,browDown_L,...               the blendshapes in their order
k,33,x,y,z,ax,ay,az,lx,ly,rx,ry,0.1,...     time; head position and angles; left and right eye; the weights
"""

from collections.abc import Sequence

from capture_plan.curves.text import Lines, TextTable
from capture_plan.errors import RigError

POSE = ("headX", "headY", "headZ", "headPitch", "headYaw", "headRoll")
EYES = ("leftEyePitch", "leftEyeYaw", "rightEyePitch", "rightEyeYaw")
LEAD = ("timestamp_ms", *POSE, *EYES)
USUAL = (
    *("browInnerUp", "browDown_L", "browDown_R", "browOuterUp_L", "browOuterUp_R"),
    *(f"eyeLook{way}_{side}" for way in ("Up", "Down", "In", "Out") for side in "LR"),
    *(f"eye{what}_{side}" for what in ("Blink", "Squint", "Wide") for side in "LR"),
    *("cheekPuff", "cheekSquint_L", "cheekSquint_R", "noseSneer_L", "noseSneer_R"),
    *("jawOpen", "jawForward", "jawLeft", "jawRight"),
    *("mouthFunnel", "mouthPucker", "mouthLeft", "mouthRight"),
    *("mouthRollUpper", "mouthRollLower", "mouthShrugUpper", "mouthShrugLower", "mouthClose"),
    *(
        f"mouth{what}_{side}"
        for what in ("Smile", "Frown", "Dimple", "UpperUp", "LowerDown", "Press", "Stretch")
        for side in "LR"
    ),
    "tongueOut",
)  # where no line names them: the order in which Face Cap sends them


def is_face_cap(texts: Sequence[str]) -> bool:
    """Whether these lines are Face Cap's."""
    kinds = {text.partition(",")[0].strip() for text in texts[:20]}
    return "k" in kinds and kinds <= {"k", "bs", "info"}


def as_table(lines: Lines) -> TextTable:
    """The frames as a table below one line of names."""
    named = [text.split(",")[1:] for text in lines.texts if text.startswith("bs,")]
    names = tuple(name.strip() for name in named[0]) if named else USUAL
    frames = [
        (text[2:], number) for text, number in zip(lines.texts, lines.numbers, strict=True) if text.startswith("k,")
    ]
    width = max(len(text.split(",")) for text, _ in frames[:20])
    if width < len(names) + 1:
        raise RigError(f"has {width - 1} numbers in a frame for {len(names)} blendshapes: export the take again")
    lead = LEAD[: width - len(names)] + ("",) * max(0, width - len(names) - len(LEAD))
    notes = () if named else ("it names no blendshapes: Face Cap's usual order of 52 is taken",)
    rows, numbers = tuple(text for text, _ in frames), tuple(number for _, number in frames)
    return TextTable((*lead, *names), rows, numbers, ",", notes=(*lines.notes, *notes))
