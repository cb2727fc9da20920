"""When the bodies touch and what that does: phases and impacts (``phases``), event functions (``events``).

``interface`` says what may meet. Imports `bodies`. Start at ``phases``.
"""
