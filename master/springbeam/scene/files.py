"""Scene files as TOML: those that come with the package, and one to start from. Nothing is validated here."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_HERE = Path(__file__).parent


def shipped_scenes() -> dict[str, Path]:
    """Return names and files of the scenes that come with the package."""
    return {path.stem: path for path in sorted((_HERE / "shipped").glob("*.toml"))}


def tables_of(path: Path) -> dict[str, Any]:
    """Return the content of a TOML file. Raises ValueError, RecursionError or OSError if it cannot be read."""
    return tomllib.loads(path.read_text(encoding="utf-8-sig"))


def parse_value(text: str) -> Any:
    """Return a value given in TOML syntax; a bare word is taken as a string."""
    with suppress(ValueError, RecursionError):
        parsed = tomllib.loads(f"value = {text}")
        if parsed.keys() == {"value"}:
            return parsed["value"]
    with suppress(ValueError):
        return float(text)  # ".5" and "1." are not TOML
    return text


def write_tables(tables: Mapping[str, Any], title: str) -> str:
    """Return a scene in TOML, with a first line that says what it is."""
    import tomli_w

    return f"# {title}\n" + tomli_w.dumps(tables)


def beginning(title: str) -> str:
    """Return a commented scene file to start from: an aluminium beam above a rubber bumper above a stop."""
    import tomli_w

    return tomli_w.dumps({"title": title}) + (_HERE / "beginning.toml").read_text(encoding="utf-8")
