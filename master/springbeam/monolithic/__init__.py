"""Independent references: the pair solved as one system. Imports `scene` and
`results.trajectory` only, so that agreement with the coupling is evidence.

Start with ``laws`` (what joins the ends, a class each), ``hybrid_system`` (the equations of each phase) and
``event_driven`` (the run); ``exponential`` integrates a phase, ``location`` finds its end, ``transitions`` applies
what happens there. ``algorithm1`` is Ahn & Tate's own scheme,
``semi_discrete`` their beam.
"""
