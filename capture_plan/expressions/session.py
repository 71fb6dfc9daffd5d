"""The session: everything that is shot, in order, with the words for the actor and the clock.

Data     packing, settings with the seconds that each thing takes
Order    calibration; neutral, teeth, neutral turned left and right; expressions with a pause every few; a neutral in
         the middle and at the end, since faces tire and markers shift
Warm     of the expressions the first few in the order of gain that are easy come before all others: a face that is warm
         and an actor who knows the game do the hard ones better; the names stay those of the order of gain
Time     of an expression   (hold + slate)(1 + retakes) + explain + harder (level - 1)
Budget   as many expressions as end, with the last neutral, within the minutes there are; the others follow it as spare
Stop     the first expression after which ENOUGH of the importance is covered, else the last that fits; the last
         neutral is taken in any case
"""

from typing import Literal

from msgspec import Struct, structs

from capture_plan.errors import InfeasibleError
from capture_plan.expressions.difficulty import Difficulty, difficulty
from capture_plan.expressions.fallback import ItemPart, fallback
from capture_plan.expressions.record import Expression, Packing
from capture_plan.expressions.sentences import from_rest, mistakes
from capture_plan.expressions.session_settings import SessionSettings
from capture_plan.expressions.settings import MEASURED_BY, Importance
from capture_plan.once import once
from capture_plan.prose import in_series
from capture_plan.rig import Rig

ENOUGH = 0.8  # share of the importance after which a session may stop: four fifths, the usual knee of these curves
EASY = 2  # of five levels
TURN_DEGREES = 30  # as far as both eyes are still seen
CALIBRATION = "Colour chart, then the calibration board, at the height of the face: the actor can rest."
TEETH = "Bite lightly on your back teeth and draw your lips apart until the front teeth show."
PAUSE = "Pause: shake the face loose, drink, check that no marker has shifted."
LAST = "N3"  # the last neutral
REST = "Relax your whole face: eyes open, looking straight ahead, jaw and lips loosely closed."

_Kind = Literal["calibration", "neutral", "teeth", "turned", "expression", "pause"]


class Item(Struct, frozen=True, forbid_unknown_fields=True):
    """One line of the shot list. Slates count everything that is shot; a pause has none.

    `hold_s` seconds are held, `seconds` is all that the item takes, `minutes` the clock after it; `covered` is the
    share of the importance so far, 0 to 1; `fits` says whether the time suffices. What follows belongs to expressions
    alone: `difficulty` how hard it is, `fallback` what to shoot where it does not work, `mistakes` what to avoid.
    """

    kind: _Kind
    slate: str
    name: str
    sentence: str
    hold_s: float
    seconds: float
    minutes: float
    covered: float
    fits: bool = True
    blendshapes: tuple[str, ...] = ()
    weights: tuple[float, ...] = ()
    drivers: tuple[str, ...] = ()
    difficulty: Difficulty | None = None
    fallback: tuple[ItemPart, ...] = ()
    mistakes: tuple[str, ...] = ()


class Session(Struct, frozen=True, forbid_unknown_fields=True):
    """The shot list. The first `fitting` expressions and the last neutral take `minutes`; `items` after those are for
    time that is left. `stop_after` names the expression after which a session may end, `stop` says so; empty where only
    the last would do.
    """

    settings: SessionSettings
    items: tuple[Item, ...]
    minutes: float
    fitting: int
    stop_after: str
    stop: str


@once
def session(
    rig: Rig, used: tuple[str, ...], packing: Packing, settings: SessionSettings, importance: Importance = "error"
) -> Session:
    """The shot list of a packing, whose shares are of this kind of importance.

    Raises InfeasibleError where not even what frames the expressions fits into the time there is.
    """
    shown = [_expression(rig, used, expression, settings) for expression in packing.expressions]
    fitting = _most_that_fit(shown, settings)
    in_order = easy_first(shown[:fitting], settings.easy_first)
    planned = _clocked(_framed(in_order, settings))
    items = (*planned, *_clocked(_spare(shown[fitting:], settings), after=planned[-1]))
    stop = _stop(in_order, cut=fitting < len(shown))
    stop = next((item for item in planned if stop and item.name == stop.name), None)
    return Session(
        settings=settings,
        items=items,
        minutes=planned[-1].minutes,
        fitting=fitting,
        stop_after=stop.name if stop else "",
        stop=_stop_words(stop, planned[-1], MEASURED_BY[importance]) if stop else "",
    )


def easy_first(expressions: list[Item], count: int) -> list[Item]:
    """The expressions with the first `count` easy ones ahead, and what is covered after each in this order.

    Expressions of a packing show each their own blendshapes, so that what each gains is the same wherever it stands.
    """
    easy = [item for item in expressions if item.difficulty and item.difficulty.level <= EASY][:count]
    if not easy:
        return expressions
    before = [0.0, *(item.covered for item in expressions)]
    gain = {item.name: after - so_far for item, so_far, after in zip(expressions, before, before[1:], strict=False)}
    ahead = {item.name for item in easy}
    ordered, covered = [], 0.0
    for item in [*easy, *(item for item in expressions if item.name not in ahead)]:
        covered += gain[item.name]
        ordered.append(structs.replace(item, covered=round(covered, 9)))
    return ordered


def shot_title(item: Item) -> str:
    """'Shot 6', the one number that pages, cards and tables count by, in the order of shooting; 'Pause'."""
    return f"Shot {shot_number(item)}" if item.slate else item.kind.capitalize()


def shot_number(item: Item) -> str:
    """'6' for slate 006; empty for a pause."""
    return item.slate.lstrip("0")


def shot_note(item: Item, of: Session) -> str:
    """'of 25 · E03', what stands beside the title of a shot: of how many, and its name in the plan and in files."""
    return f"of {sum(bool(one.slate) for one in of.items)} · {item.name}" if item.slate else ""


def stop_below(of: Session) -> str:
    """The item below which a list says where to stop: the expression, or the last neutral where that follows at once;
    empty where nothing is said."""
    names = [item.name for item in of.items]
    if not of.stop_after:
        return ""
    return LAST if names[names.index(of.stop_after) + 1] == LAST else of.stop_after


def easy_words(of: Session) -> str:
    """'Shots 6 and 7 (E03, E04) come first because they are easy.'; empty where the order of gain stands."""
    shown = [item for item in of.items if item.kind == "expression" and item.fits]
    names = [item.name for item in shown]
    ahead = shown[: names.index(min(names, key=_number))] if names else []
    if not ahead:
        return ""
    come = "comes first because it is easy" if len(ahead) == 1 else "come first because they are easy"
    shots = f"Shot{'s' if len(ahead) > 1 else ''} {in_series([shot_number(item) for item in ahead])}"
    return f"{shots} ({', '.join(item.name for item in ahead)}) {come}."


def _number(name: str) -> tuple[int, str]:
    """What orders E09 before E100."""
    return len(name), name


def spare_words(of: Session) -> str:
    """'Shots 14 to 27 (E05 to E18), 14 of 18 expressions, do not fit into 10 minutes: spare, if time is left.'; empty
    where all fit."""
    shown = [item for item in of.items if item.kind == "expression"]
    spare = [item for item in shown if not item.fits]
    if not spare:
        return ""
    first, last = spare[0], spare[-1]
    named = f"Shots {shot_number(first)} to {shot_number(last)} ({first.name} to {last.name})"
    named = named if len(spare) > 1 else f"Shot {shot_number(first)} ({first.name})"
    fit = "does not fit" if len(spare) == 1 else "do not fit"
    return (
        f"{named}, {len(spare)} of {len(shown)} expressions, {fit} into {of.settings.minutes:g} minutes: "
        "spare, if time is left."
    )


def _stop_words(stop: Item, last: Item, measured: str) -> str:
    """Where to stop when time runs out, which neutral is taken then, and what has been covered by when."""
    return (
        f"If time runs out, stop after shot {shot_number(stop)} ({stop.name}), take the last neutral, shot "
        f"{shot_number(last)} ({last.name}): {stop.covered:.0%} of {measured} is covered by minute {stop.minutes:.0f}."
    )


def _most_that_fit(shown: list[Item], settings: SessionSettings) -> int:
    if settings.minutes is None:
        return len(shown)
    for count in range(len(shown), -1, -1):
        if _clocked(_framed(shown[:count], settings))[-1].minutes <= settings.minutes:
            return count
    least = _clocked(_framed([], settings))[-1].minutes
    raise InfeasibleError(
        f"{settings.minutes:g} minutes are too few: calibration and neutrals alone take {least:.1f}: give more, or "
        "shorten them in the session settings"
    )


def _framed(expressions: list[Item], settings: SessionSettings) -> list[Item]:
    """Expressions with everything that is shot before, between and after them."""
    middle = len(expressions) // 2
    items = _opening(settings)
    for count, expression in enumerate(expressions):
        if count and count == middle:
            items.append(_frame("neutral", "N2", f"Once more a neutral. {REST}", settings.neutral_s, settings))
        elif count and count % settings.relax_every == 0 and abs(count - middle) > 1:
            items.append(_pause(settings))
        items.append(expression)
    return [*items, _frame("neutral", LAST, f"A last neutral. {REST}", settings.neutral_s, settings)]


def _opening(settings: SessionSettings) -> list[Item]:
    turn = f"Turn your head {TURN_DEGREES} degrees to your {{side}}, look where your nose points and relax your face."
    return [
        _frame("calibration", "C1", CALIBRATION, settings.calibration_s, settings),
        _frame("neutral", "N1", REST, settings.neutral_s, settings),
        _frame("teeth", "T1", TEETH, settings.neutral_s, settings),
        _frame("turned", "L1", turn.format(side="left"), settings.neutral_s, settings),
        _frame("turned", "R1", turn.format(side="right"), settings.neutral_s, settings),
    ]


def _spare(expressions: list[Item], settings: SessionSettings) -> list[Item]:
    """What does not fit, with a pause every few."""
    items: list[Item] = []
    for count, expression in enumerate(expressions):
        if count and count % settings.relax_every == 0:
            items.append(_pause(settings))
        items.append(structs.replace(expression, fits=False))
    return items


def _frame(kind: _Kind, name: str, sentence: str, seconds: float, settings: SessionSettings) -> Item:
    return Item(kind, "", name, sentence, min(settings.hold_s, seconds), seconds, 0.0, 0.0)


def _pause(settings: SessionSettings) -> Item:
    return Item("pause", "", "", PAUSE, 0.0, settings.relax_s, 0.0, 0.0)


def _expression(rig: Rig, used: tuple[str, ...], expression: Expression, settings: SessionSettings) -> Item:
    hard = difficulty(rig, expression.blendshapes + expression.drivers)
    takes = (settings.hold_s + settings.slate_s) * (1 + settings.retakes)
    return Item(
        kind="expression",
        slate="",
        name=expression.name,
        sentence=from_rest(expression.sentence),
        hold_s=settings.hold_s,
        seconds=takes + settings.explain_s + settings.harder_s * (hard.level - 1),
        minutes=0.0,
        covered=expression.covered,
        blendshapes=expression.blendshapes,
        weights=expression.weights,
        drivers=expression.drivers,
        difficulty=hard,
        fallback=fallback(rig, used, expression),
        mistakes=mistakes(rig, expression.blendshapes),
    )


def _clocked(items: list[Item], after: Item | None = None) -> list[Item]:
    """Items with their slates, the clock after each and what is covered so far, going on where `after` ended."""
    number, seconds, covered = (int(after.slate), 60 * after.minutes, after.covered) if after else (0, 0.0, 0.0)
    clocked = []
    for item in items:
        number += item.kind != "pause"
        seconds += item.seconds
        covered = max(covered, item.covered)
        slate = f"{number:03d}" if item.kind != "pause" else ""
        clocked.append(structs.replace(item, slate=slate, minutes=round(seconds / 60, 3), covered=covered))
    return clocked


def _stop(fitting: list[Item], *, cut: bool) -> Item | None:
    """Where to stop: once enough is covered, else with the last that fits where others do not."""
    enough = next((item for item in fitting[:-1] if item.covered >= ENOUGH), None)
    return enough or (fitting[-1] if fitting and cut else None)
