"""What a part of a run carries from one step to the next, as one value: a checkpoint keeps it, a restore sets it."""

from __future__ import annotations

from typing import Any

import msgspec

#: All that a run changes while it runs: by part, what `Stateful.save` returns.
RunState = dict[str, bytes]


class Memory(msgspec.Struct, forbid_unknown_fields=True):
    """Named numbers that a part changes in place."""


class Stateful:
    """A part of a run whose future depends on its past."""

    #: All that changes and is not set anew before it is used: a number, a typed tuple, or a `Memory`.
    state: Any = None

    def save(self) -> bytes:
        """Return `state` as MessagePack, numbers to the last bit."""
        return msgspec.msgpack.encode(self.state)

    def restore(self, saved: bytes) -> None:
        """Go on from what `save` of an equal part returned. Raises msgspec.DecodeError if it was of another kind."""
        self.state = msgspec.msgpack.decode(saved, type=type(self.state))
