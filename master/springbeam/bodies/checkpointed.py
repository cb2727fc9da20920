"""What a run carries from one step to the next, so that a checkpoint can hold it.

Every part of a run that changes while it runs is a `Checkpointed` and names the attributes that change. Whatever is not
named must follow from the scene or be computed anew to the same bits.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, ClassVar


class Checkpointed:
    """Mixin for a part of a run whose future depends on its past."""

    #: The attributes that a checkpoint holds: further parts, or plain values (`springbeam.run.checkpoint` lists their
    #: types).
    CHECKPOINTED: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def checkpointed_names(cls) -> tuple[str, ...]:
        """Return `CHECKPOINTED`, or all fields of a dataclass."""
        return tuple(field.name for field in fields(cls)) if is_dataclass(cls) else cls.CHECKPOINTED

    def save(self) -> Any:
        """Return the checkpointed attributes by name, parts as nested dicts; lists and arrays are the run's own."""
        parts = {name: getattr(self, name) for name in self.checkpointed_names()}
        return {name: part.save() if hasattr(part, "save") else part for name, part in parts.items()}

    def restore(self, saved: Any) -> None:
        """Continue from what `save` of an equal part returned. Raises ValueError if it was another kind of part."""
        names = self.checkpointed_names()
        if not isinstance(saved, dict) or saved.keys() != set(names):
            raise ValueError(f"{type(self).__name__} checkpoints {', '.join(names)}; not found")
        for name in names:
            part = getattr(self, name)
            if hasattr(part, "restore"):
                part.restore(saved[name])
            else:
                setattr(self, name, saved[name])
