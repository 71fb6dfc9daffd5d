"""Rigs with known truth: heads x channels x axes x units x places x names x what the format states; and a judge.

    python -m tests.face_family 2000        judges 2,000 of them and prints how many are right
    python -m tests.face_family 2000 plain  the same of the sample's own blendshapes, with nothing stated falsely
    python -m tests.face_family 0:17 0:312  judges single ones (seed:index) and prints what was understood

Truth: rotation R and unit u with rig = u R file; eyes and mouth in millimetres of the rig's frame. A family visits the
values of every factor in turn, each factor in an order of its own, so that any n cases in a row show each of up to n
values; a case depends on nothing but seed and index.
"""

import random
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product

import numpy as np

from capture_plan.errors import RigError
from capture_plan.face.axes import axes_matrix
from capture_plan.face.reading import face_reading
from capture_plan.formats.raw import RawRig
from capture_plan.reader.read import rig_from_raw
from capture_plan.rig import Rig
from capture_plan.rig.read_options import AXES
from capture_plan.rig.understood import Reading, Vector
from tests.face_channels import CHANNELS, NAMINGS, PLACINGS
from tests.face_heads import KINDS, Head, sample_head

PAIRS = [(up, facing) for up, facing in product(AXES, AXES) if up[1] != facing[1]]
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
STATEMENTS = ("silent", "true", "axes false", "unit false", "both false")
FACTORS = {
    "kind": list(KINDS),
    "channels": list(CHANNELS),
    "axes": PAIRS,
    "unit": list(UNITS),
    "placed": list(PLACINGS),
    "names": list(NAMINGS),
    "stated": list(STATEMENTS),
}
PLAIN = FACTORS | {"channels": ["full"], "placed": ["at_home"], "stated": ["silent", "true"]}
QUESTIONS = ("axes", "unit", "eyes", "mouth")
NEAR_MM = 10.0  # for pupils that are 60 mm apart
PUPILS_MM = 60.0
SAME_UNIT = 0.01


@dataclass(frozen=True, eq=False)
class Truth:
    """rig = unit_mm * rotation @ file; places in millimetres in the rig's frame."""

    up: str
    facing: str
    unit_mm: float
    eye_left: np.ndarray
    eye_right: np.ndarray
    mouth: np.ndarray
    eye_depth: float = 0.0

    @property
    def rotation(self) -> np.ndarray:
        return axes_matrix(self.up, self.facing)

    @property
    def near_mm(self) -> float:
        """How far from the truth a place may be."""
        return NEAR_MM * float(np.linalg.norm(self.eye_left - self.eye_right)) / PUPILS_MM


@dataclass(frozen=True, eq=False)
class Case:
    """One rig of the family: `values` says which value each factor has."""

    seed: int
    index: int
    values: dict[str, object]
    raw: RawRig
    truth: Truth

    def __str__(self) -> str:
        return f"{self.seed}:{self.index} {in_words(self.values)}"


def family(count: int, seed: int):
    """The first cases of a family, one after the other."""
    return (family_case(seed, index) for index in range(count))


def family_case(seed: int, index: int, *, plain: bool = False) -> Case:
    """One case of the family, alone."""
    values = factor_values(seed, index, plain=plain)
    rng = random.Random(f"{seed} {index}")
    head = KINDS[values["kind"]](sample_head())
    head = CHANNELS[values["channels"]](head)
    head = NAMINGS[values["names"]](PLACINGS[values["placed"]](head, rng), rng)
    up, facing = values["axes"]
    truth = Truth(up, facing, UNITS[values["unit"]], head.eye_left, head.eye_right, head.mouth, head.eye_depth)
    return Case(seed, index, values, raw_rig(head, truth, statement(values["stated"], truth, rng)), truth)


def factor_values(seed: int, index: int, *, plain: bool = False) -> dict:
    """The value of every factor in one case."""
    chosen = {}
    for factor, values in (PLAIN if plain else FACTORS).items():
        turn, place = divmod(index, len(values))
        chosen[factor] = random.Random(f"{seed} {factor} {turn}").sample(values, len(values))[place]
    return chosen


def statement(stated: str, truth: Truth, rng: random.Random) -> tuple[float | None, str | None, str | None]:
    """What the format says: unit, up, facing."""
    if stated == "silent":
        return None, None, None
    unit, (up, facing) = truth.unit_mm, (truth.up, truth.facing)
    if stated in ("unit false", "both false"):
        unit = rng.choice([other for other in UNITS.values() if other != unit])
    if stated in ("axes false", "both false"):
        up, facing = rng.choice([pair for pair in PAIRS if pair != (up, facing)])
    return unit, up, facing


def raw_rig(head: Head, truth: Truth, stated: tuple[float | None, str | None, str | None]) -> RawRig:
    """What a reader would give of this head in a file of that unit and those axes."""
    to_file = (truth.rotation / truth.unit_mm).astype(np.float32)
    return RawRig(
        name="case",
        neutral=head.neutral @ truth.rotation / truth.unit_mm,
        triangles=head.triangles,
        deltas=head.deltas @ to_file,
        names=head.names,
        parts=head.parts,
        part_names=head.part_names,
        source_index=np.arange(len(head.neutral), dtype=np.int32),
        unit_mm=stated[0],
        up=stated[1],
        facing=stated[2],
    )


# ---------------------------------------------------------------- the judge
def judge(rig: Rig, reading: Reading, truth: Truth) -> dict[str, str]:
    """For each question "right", "not sure" or "wrong".

    Places are compared in the file's coordinates, so a wrong unit or wrong axes do not make them wrong as well.
    """
    off = distances(rig, reading, truth)
    axes = (reading.axes.up, reading.axes.facing) == (truth.up, truth.facing)
    unit = abs(reading.unit.mm / truth.unit_mm - 1) < SAME_UNIT
    eyes = None not in (reading.eyes.left, reading.eyes.right)
    return {
        "axes": _verdict(axes, reading.axes.sure),
        "unit": _verdict(unit, reading.unit.sure),
        "eyes": _verdict(off["eyes"] <= truth.near_mm, reading.eyes.sure and eyes),
        "mouth": _verdict(off["mouth"] <= truth.near_mm, reading.mouth.sure and reading.mouth.at is not None),
    }


def _verdict(right: bool, sure: bool) -> str:
    if not sure:
        return "not sure"
    return "right" if right else "wrong"


def distances(rig: Rig, reading: Reading, truth: Truth) -> dict[str, float]:
    """How far eyes (the worse one) and mouth are from the truth, true millimetres; infinite where not found."""

    def off(found: Vector | None, right: np.ndarray, depth: float = 0.0) -> float:
        if found is None:
            return np.inf
        x, y, z = truth.unit_mm * truth.rotation @ in_file(rig, np.array(found)) - right
        return float(np.linalg.norm([x, y, max(abs(z) - depth, 0)]))

    sides = ((reading.eyes.left, truth.eye_left), (reading.eyes.right, truth.eye_right))
    eyes = max(off(found, right, truth.eye_depth) for found, right in sides)
    return {"eyes": eyes, "mouth": off(reading.mouth.at, truth.mouth)}


def in_file(rig: Rig, point: np.ndarray) -> np.ndarray:
    """A point of the rig's frame in the file's axes and unit, also where the rig doesn't say how it was turned."""
    if rig.turn == (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0):
        return point @ axes_matrix(rig.up, rig.facing) / rig.unit_mm
    return rig.in_file(point)


def judged(case: Case) -> tuple[dict[str, str], str]:
    """The verdicts on one case, and what was understood of it in a line. A rig that is refused is all wrong."""
    try:
        rig = rig_from_raw(case.raw)
        reading = face_reading(rig)
    except RigError as error:
        return dict.fromkeys(QUESTIONS, "wrong"), str(error)
    off = distances(rig, reading, case.truth)
    message = f"up {reading.axes.up} facing {reading.axes.facing} unit {reading.unit.mm:.4g}"
    message += f" eyes {off['eyes']:.0f} mm off, mouth {off['mouth']:.0f} mm off"
    return judge(rig, reading, case.truth), message


# ---------------------------------------------------------------- the command
def _judged_alone(seed: int, index: int, plain: bool) -> tuple[dict, dict[str, str], str]:
    case = family_case(seed, index, plain=plain)
    return (case.values, *judged(case))


def measure(count: int, *, plain: bool, seed: int = 0, workers: int = 2) -> bool:
    """Judges a family, prints tables of the verdicts and every wrong case; whether none is wrong."""
    with ProcessPoolExecutor(workers) as pool:
        results = list(pool.map(_judged_alone, [seed] * count, range(count), [plain] * count, chunksize=4))
    print(f"{count} cases, seed {seed}: right / not sure / wrong")
    for question in (*QUESTIONS, "all four"):
        print(f"  {question:10}", _row([_of(verdicts, question) for _, verdicts, _ in results]))
    for factor, values in (PLAIN if plain else FACTORS).items():
        print(f"{factor:32} {'all four':>18} " + " ".join(f"{question:>18}" for question in QUESTIONS))
        for value in values:
            some = [verdicts for chosen, verdicts, _ in results if chosen[factor] == value]
            name = "/".join(value) if isinstance(value, tuple) else value
            print(f"  {name:30}", *(_row([_of(v, q) for v in some]) for q in ("all four", *QUESTIONS)))
    wrong = [(i, chosen, v, message) for i, (chosen, v, message) in enumerate(results) if "wrong" in v.values()]
    print(f"{len(wrong)} wrong; one alone: python -m tests.face_family SEED:INDEX")
    for i, chosen, verdicts, message in wrong:
        what = ", ".join(question for question in QUESTIONS if verdicts[question] == "wrong")
        print(f"  {seed}:{i} {in_words(chosen)}\n      WRONG {what}: {message}")
    return not wrong


def in_words(values: dict) -> str:
    """The value of every factor in a line."""
    return " ".join("/".join(v) if isinstance(v, tuple) else v.replace(" ", "_") for v in values.values())


def _of(verdicts: dict[str, str], question: str) -> str:
    """The verdict on a question, or the worst of all."""
    if question in verdicts:
        return verdicts[question]
    return next((v for v in ("wrong", "not sure") if v in verdicts.values()), "right")


def _row(verdicts: list[str]) -> str:
    count = Counter(verdicts)
    return f"{count['right']:>6} {count['not sure']:>5} {count['wrong']:>5}"


def main() -> int:
    first = sys.argv[1]
    if ":" not in first:
        return 0 if measure(int(first), plain="plain" in sys.argv) else 1
    for name in sys.argv[1:]:
        case = family_case(*map(int, name.split(":")))
        print(case, *judged(case), sep="\n  ")
    return 0


if __name__ == "__main__":
    sys.exit(main())
