"""Independent references: the pair solved as one system. Imports `scene` and
`results.trajectory` only, so that agreement with the coupling is evidence.

Start with ``laws`` (what joins the ends, a class each) and ``hybrid_system`` (coordinates of mass 1, and what holds and
moves them in each phase, also for a beam without inertia). ``event_driven`` is the run: ``exponential``
integrates up to an event, ``transitions`` applies what happens there, ``rows`` makes the result. ``semi_discrete`` is
the beam.
"""
