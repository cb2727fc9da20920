"""Independent references: the pair solved as one system. Imports `scene` and
`results.trajectory` only, so that agreement with the coupling is evidence.

Start with ``laws`` (what joins the ends, a class each), ``hybrid_system`` (the equations of each phase) and
``event_driven`` (the run, and where a phase ends); ``exponential`` integrates a phase, ``transitions`` applies
what happens there. ``algorithm1`` is Ahn & Tate's own scheme,
``semi_discrete`` their beam.
"""
