"""When the bodies touch and what that does: phases and impacts (``phases``), event functions (``events``).

Imports `scene` and `bodies`. Start at ``phases``.
"""
