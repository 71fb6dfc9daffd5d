"""What is found of a record is found once, and the record holds it: it goes when the record goes.

Answers   vars(record)["answers"][function, arguments], beside the record's own cached properties
"""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

import msgspec
import numpy as np

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


def once(function: Callable[Concatenate[R, P], T]) -> Callable[Concatenate[R, P], T]:
    """A function or method of a frozen record that is computed when it is asked for, and once for equal arguments.

    The answer lives as long as the record. One that was changed (`dataclasses.replace`) is another record and asked
    anew. Arguments are hashable, arrays or settings.

    Example:
        >>> size = once(lambda rig: rig.neutral.max(axis=0) - rig.neutral.min(axis=0))
        >>> size(sample_rig()) is size(sample_rig())
        True
    """

    @wraps(function)
    def answered(record: R, *arguments: P.args, **options: P.kwargs) -> T:
        answers: _Answers = vars(record).setdefault("answers", _Answers())
        key = (function, *map(_key, arguments), *((name, _key(value)) for name, value in sorted(options.items())))
        if key not in answers:
            answers[key] = function(record, *arguments, **options)
        return answers[key]

    return answered


class _Answers(dict[Hashable, Any]):
    """Answers by function and arguments; a copy of the record, in another process too, starts without any."""

    def __reduce__(self) -> tuple[type, tuple[()]]:
        return _Answers, ()


def _key(argument: Any) -> Hashable:
    if isinstance(argument, np.ndarray):
        return argument.shape, argument.dtype.str, argument.tobytes()
    return type(argument), msgspec.json.encode(argument) if isinstance(argument, msgspec.Struct) else argument
