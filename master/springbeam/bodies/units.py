"""Units that an FMU declares for its variables, and how many SI units each of them is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

#: SI units of the keys of a scene that name variables of an FMU: their names and their powers of kg, m and s.
_SI: dict[str, tuple[str, tuple[int, int, int]]] = {
    "time": ("s", (0, 0, 1)),
    "force": ("N", (1, 1, -2)),
    "impulse": ("N.s", (1, 1, -1)),
    "displacement": ("m", (0, 1, 0)),
    "velocity": ("m/s", (0, 1, -1)),
    "acceleration": ("m/s2", (0, 1, -2)),
    "integral": ("m.s", (0, 1, 1)),
    "integral_2": ("m.s2", (0, 1, 2)),
    "kinetic_energy": ("J", (1, 2, -2)),
    "potential_energy": ("J", (1, 2, -2)),
    "dissipated_energy": ("J", (1, 2, -2)),
    "load_potential": ("J", (1, 2, -2)),
}
_POWERS = {"kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "J": (1, 2, -2)}
_PART = re.compile(r"([/.*·]?)(kg|m|s|N|J)\^?(-?\d)?")
#: Powers that no mechanical quantity of an end has.
_OTHERS = ("A", "K", "mol", "cd", "rad")


class Unit(NamedTuple):
    """A unit by its name, "" if none is declared, and how many SI units it is."""

    name: str = ""
    factor: float = 1.0


def unit_of(key: str, declared: str | None, definition: Any) -> Unit:
    """Return the unit of the variable that is a scene's ``key``.

    Parameters
    ----------
    declared
        Its name; ``None`` if the FMU declares none: then the value is taken to be in SI units.
    definition
        What the FMU says of it, with its ``baseUnit``: FMI 2.0.4, section 2.2.2. Without one the name must be that of
        the SI unit.

    Raises
    ------
    ValueError
        If it is a unit of something else, or if nothing says how large it is.
    """
    si, powers = _SI[key]
    if not declared:
        return Unit()
    base = definition and definition.baseUnit
    if base is None:
        if _spelled(declared) == powers:
            return Unit(declared)
        remedy = f"declare its BaseUnit in the FMU, or use {si}"
        raise ValueError(f"is in {declared!r}, and the FMU does not say how much that is; {remedy}")
    if (base.kg, base.m, base.s) != powers or any(getattr(base, other) for other in _OTHERS):
        raise ValueError(f"is in {declared!r}, which is not a unit of {key} ({si}); name another variable")
    if not base.factor > 0.0 or base.offset:
        what = f"whose BaseUnit has factor {base.factor:g} and offset {base.offset:g}"
        raise ValueError(f"is in {declared!r}, {what}; use a unit with a factor above 0 and without offset")
    return Unit(declared, base.factor)


def described(named: Mapping[str, str], units: Mapping[str, Unit]) -> list[str]:
    """Return in words how variables, which are ``named`` by key, are converted, and which are taken to be in SI units.

    ``units`` are theirs by key, and that of the time.
    """
    names = {"time": "the time", **named}
    lines = [
        f"{names[key]} is in {unit.name}, that is {unit.factor:g} {_SI[key][0]}"
        for key, unit in units.items()
        if unit.factor != 1.0
    ]
    assumed = [f"{name} in {_SI[key][0]}" for key, name in named.items() if not units[key].name]
    return [*lines, *([f"no unit is declared, so SI units are assumed: {', '.join(assumed)}"] if assumed else [])]


def _spelled(name: str) -> tuple[int, ...] | None:
    """Return the powers of kg, m and s of a unit as "kg.m/s2"; ``None`` if it is not made of SI units."""
    if not re.fullmatch(f"(?:{_PART.pattern})+", name):
        return None
    total = [0, 0, 0]
    for sign, symbol, power in _PART.findall(name):
        times = int(power or 1) * (-1 if sign == "/" else 1)
        total = [sum_ + times * each for sum_, each in zip(total, _POWERS[symbol], strict=True)]
    return tuple(total)
