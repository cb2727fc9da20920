"""Units of measured columns as people write them: ``m/s^2``, ``m/s2``, ``m s-2``, ``m.s-2``, ``m·s⁻²``, ``gn``."""

import re

#: Standard gravity [m/s²].
GRAVITY = 9.80665
#: Names for which pint has something else, and what is meant: no curve of a run is a mass.
_MEANT = {
    **dict.fromkeys(("g", "G", "gn", "g_n", "g0", "g_0"), "standard_gravity"),
    "mg": "millistandard_gravity",
    "Nm": "(N*m)",
    "Nmm": "(N*mm)",
    "Ns": "(N*s)",
    "″": "inch",
}
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
#: One factor of a unit: its sign, its name and its power.
_FACTOR = re.compile(
    r"\s*([/*·⋅.]?)\s*(g_?0|[^\W\d_]+(?:_[^\W\d_]+)*|[°%″][^\W\d_]*|1(?=\s*/))(?:\^|\*\*)?([+-]?\d+)?\s*"
)


def factor(unit: str, wanted: str) -> float:
    """Return how many ``wanted`` one ``unit`` is. Raises ValueError if it is no unit, or one of something else.

    ``g`` is standard gravity.
    """
    if (unit, wanted) == ("g", "m/s²"):
        return GRAVITY
    given = _for_pint(unit)
    to = _for_pint(wanted)
    if given == to:
        return 1.0
    from pint import PintError, Quantity  # takes a second: only if there are units to convert

    try:
        return float(Quantity(1.0, given).to(to).magnitude)
    except PintError as error:
        raise ValueError(f"[{unit}] is no unit of what a run has in {wanted}: {error}") from error


def _for_pint(unit: str) -> str:
    """Return ``unit`` in the syntax of pint, as a product of powers of names."""
    text = unit.translate(_RAISED)
    factors = _FACTOR.findall(text)
    if not factors or "".join(match[0] for match in _FACTOR.finditer(text)) != text:
        raise ValueError(f"[{unit}] is no unit; write one as in [m/s^2]")
    parts = (f"{'/' if sign == '/' else '*'}{_MEANT.get(name, name)}**{power or 1}" for sign, name, power in factors)
    return "1" + "".join(parts)
