"""What one unit of a clock's numbers is in seconds, where neither name nor form tells it: by the rates that units give.

Step     s units from frame to frame; a unit of u seconds makes 1 / (u s) frames in a second
Decimal  seconds, milli-, micro-, nanoseconds and tenths of a microsecond are usual
Others   of whole numbers 1/600 s of CMTime count as well; hundredths, 1/90,000 and more where none of these is usual
Epoch    whole numbers near the time since 1970 (or 1601) have the unit in which they are that
One usual rate is sure; several, or none, are said to be uncertain.
"""

from capture_plan.curves.clock_cells import CLOCKS, Clock

UNITS_S = (1.0, 1e-3, 1e-6, 1e-7, 1e-9)
OTHERS_S = {
    **{1 / n: f"1/{n:,} s" for n in (100, 600, 10_000, 24_000, 48_000, 90_000, 141_120_000)},
    **{1 / 705_600_000: "flicks", 1 / 46_186_158_000: "ticks of FBX"},
}
CMTIME = 1 / 600
NAMES = {1.0: "s", 1e-3: "ms", 1e-6: "\u00b5s", 1e-7: "0.1 \u00b5s", 1e-9: "ns"} | OTHERS_S
RATES = (10.0, 12.0, 12.5, 15.0, *map(float, CLOCKS))
LIKELY_FPS = (10.0, 250.0)  # of a take, where the unit of its times is guessed
FAST = 200.0  # faces are seldom recorded faster, and never in silence
SEEN = tuple(float(rate) for rate in CLOCKS if rate <= FAST)
EPOCHS_S = (1.2e9, 2.6e9), (1.29e10, 1.42e10)  # since 1970: years 2008 to 2052; since 1601
NEAR, EXACT = 0.02, 0.005  # of a rate; of one in an unusual unit


def unit_by(clock: Clock, step: float) -> tuple[float, str]:
    """Seconds in the unit of times, and a sentence where it is not certain.

    The one stated where it gives a usual rate, else by the size of their step.
    """
    stated, likely = clock.stated_s, _decimal(step)
    if stated is not None:
        good = 1e-3 <= step * stated <= 1 or not is_usual(1 / (step * likely))
        return (stated if good else likely), ""
    if not clock.whole:
        return likely, ""
    if epoch := since_epoch(clock):
        return epoch, ""
    decimal = is_usual(1 / (step * likely)) and 1 / (step * likely) <= FAST
    others = [CMTIME, 1e-7] if decimal and likely == 1e-6 else [CMTIME] if decimal else [*OTHERS_S]
    found = [likely] * decimal + [unit for unit in others if is_usual(1 / (step * unit), SEEN, EXACT)]
    if found == [likely]:
        return likely, ""
    units = list(dict.fromkeys((*found, likely)))
    ways = ", ".join(f"{1 / (step * unit):.4g} in units of {NAMES[unit]}" for unit in units)
    message = f"it is not certain what its times count: steps of {step:.4g} are {ways} frames in a second"
    return units[0], f"{message}; the first is taken: give the frame rate if it is known"


def _decimal(step: float) -> float:
    """The decimal unit that gives a likely rate, the coarsest of them; else the coarsest of steps below a second."""
    rates = {unit: 1 / (step * unit) for unit in UNITS_S}
    known = (unit for unit, fps in rates.items() if LIKELY_FPS[0] <= fps <= LIKELY_FPS[1])
    return next(known, next((unit for unit in UNITS_S if step * unit < 1 or unit == UNITS_S[-1]), 1.0))


def since_epoch(clock: Clock) -> float | None:
    """The decimal unit in which the times are those since an epoch."""
    first = float(clock.ticks[0])
    return next((unit for unit in UNITS_S if any(low <= first * unit <= high for low, high in EPOCHS_S)), None)


def is_usual(fps: float, rates: tuple[float, ...] = RATES, near: float = NEAR) -> bool:
    """Whether a rate is one of those that takes have."""
    return any(abs(fps - rate) <= near * rate for rate in rates)
