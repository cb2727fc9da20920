"""When the bodies touch and what that does: phases (``phases``), guards that end them (``events``), ``impacts``.

``interface`` says what may meet. Imports `bodies`. Start at ``phases``.
"""
