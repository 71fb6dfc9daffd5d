"""What the columns of a take are beside its weights: clocks, counters, whether a face was tracked, whose, which take.

Names are compared in small letters without separators: timestamp_ms, timestampMs and "Timestamp (ms)" are one.
"""

import re
from functools import lru_cache

PATH = re.compile(r".*key_blocks\[[\"']+(.+?)[\"']*\](?:\.value)?")
CODE = re.compile("timecode|tc|smpte|smptetimecode|タイムコード|时间码|時間碼")
TIMES = "zeit(?:stempel|punkt)?|temps|horodatage|tiempo|tempo|tijd|время|時間|時刻|时间|秒|sekunden?|secondes?|segundos"
FRAMES = "bild(?:er|nummer|nr)?|image|trame|fotograma|quadro|кадр|フレーム(?:番号)?|帧(?:号)?|幀"
UNIT = r"(?P<unit>s|secs?|seconds|ms|msecs?|millis|milliseconds|us|usecs?|micros|microseconds|ns|nsecs?|nanoseconds)?"
TIME = re.compile(
    rf"(?:t|(?:frame|elapsed|capture|device|video)?time(?:stamps?)?|seconds|secs?|ms|msecs?|millis|elapsed|{TIMES})"
    rf"{UNIT}"
)
STEP = re.compile(rf"(?:(?:frame)?delta(?:time)?|dt|time(?:delta|step)|frameduration){UNIT}")
RATE = re.compile("fps|framerate|frames?per(?:second|sec|s)|(?:sample|sampling)rate")
COUNT = re.compile(rf"frame|frames|frame(?:number|num|no|index|idx|id|count)|index|idx|sample|row|number|nr|{FRAMES}")
TRACKED = re.compile(
    r"(?:is|has)?(?:face|head|facial)?(?:is)?(?:success|succeeded|tracked|tracking|detected|found|valid|visible|present)"
    r"|(?:tracking|tracker|track|face|facetracking|detection)?(?:state|status|ok|success|valid|quality)"
    r"|hasface|hasfaces|(?:num|n|no|number)(?:of)?(?:detected)?faces|faces|facescount|facecount|facesdetected"
)
LOST = re.compile(
    r"(?:is)?(?:face|tracking|track|tracker|head)?(?:is)?(?:lost|failed|missing)|lost(?:face|tracking)|noface"
)
SURE = re.compile(
    r"(?:(?:face|head|facial)?(?:tracking|tracker|track|detection|detector|landmarks?)?)(?:confidence|conf|score|certainty|quality)"
)
FACE = re.compile(
    r"(?:face|person|track|tracking|subject|actor|user|head|performer|player|people|character)(?:id|index|idx|number|num|"
    r"name|nr|no|uuid|identifier)|id|face|person|subject|actor|performer|character|player"
)
TAKE = re.compile(r"(?:take|clip|shot|slate|session|recording|sequence)(?:id|name|number|num|no|nr|index|idx)?")
SOURCE = re.compile(
    r"(?:device|camera|cam|phone|source|client|sender|host|stream|sensor|tracker|machine|who|whose|ip|ipaddress|address)"
    r"(?:id|idx|index|name|number|num|no|nr|uuid|ip|address)?"
)
WEIGHTS = re.compile("blendshapecount")
OTHER = re.compile("version|width|height")
KINDS = {
    "code": CODE,
    "time": TIME,
    "step": STEP,
    "rate": RATE,
    "count": COUNT,
    "tracked": TRACKED,
    "lost": LOST,
    "confidence": SURE,
    "face": FACE,
    "take": TAKE,
    "source": SOURCE,
    "weights": WEIGHTS,
    "other": OTHER,
}
SECONDS = {"s": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9}  # by the first letter of a unit's name
CLOCK_KINDS = ("code", "time", "step", "rate")  # what tells a rate, the surest first
MANY = 4096  # names remembered: every frame of a JSON file repeats them
PLACES = re.compile(r"(gaze|eye_lmk|pose|p)_|[xyzXYZ]_\d")  # OpenFace's directions, landmarks and head


@lru_cache(MANY)
def plain(name: str) -> str:
    """A name in small letters of any script, without separators."""
    return re.sub(r"[\W_]", "", re.sub("[\u00b5\u03bc]", "u", name.lower()))  # both signs of micro


@lru_cache(MANY)
def kind_of(name: str) -> str | None:
    """What a column is by its name: one of `KINDS`; None where it may be a weight."""
    return next((kind for kind, names in KINDS.items() if names.fullmatch(plain(name))), None)


@lru_cache(MANY)
def of_path(name: str) -> str:
    """The name of a blendshape in a path of data: key_blocks["jawOpen"].value."""
    match = PATH.fullmatch(name)
    return match[1] if match else name


def unit_of(name: str) -> float | None:
    """Seconds in the unit that a clock's name tells: 0.001 of timestamp_ms; None where it tells none."""
    short = plain(name)
    match = TIME.fullmatch(short) or STEP.fullmatch(short)
    if match is None:
        return None
    unit = match["unit"] or (short if short.startswith(("ms", "milli", "sec")) else "")
    return (
        SECONDS["m" if unit.startswith("mi") and not unit.startswith("mic") else unit.replace("mic", "u")[:1]]
        if unit
        else None
    )


@lru_cache(MANY)
def why_not(name: str) -> str | None:
    """Why a column of numbers cannot be a weight; None where it can."""
    if not name:
        return "it has no name"
    if kind_of(name):
        return "it is no weight"
    return "it is a place or a direction of OpenFace, no weight" if PLACES.match(name) else None
