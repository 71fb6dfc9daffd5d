"""Numbers as people read them, each with its unit."""


def percent(share: float) -> str:
    """A share from 0 to 1 in whole per cent."""
    return f"{100 * share:.0f} %"


def millimetres(length: float) -> str:
    """Thousandths where they say something, whole millimetres beyond 10."""
    return f"{length:.3f} mm" if length < 10 else f"{length:,.0f} mm"
