"""When the bodies touch and what that does: phases (``phases``), guards that end them (``events``), ``impacts``.

``interface`` says what may meet. The force of a soft law stands beside its keys, in `springbeam.scene.laws`. Imports
`bodies`. Start at ``phases``.
"""
