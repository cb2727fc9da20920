"""Independent references: the pair solved as one system. Imports `scene` and
`results.trajectory` only, so that agreement with the coupling is evidence.

``event_driven`` integrates the laws `transmission` and `compliance` between located events; ``algorithm1`` is Ahn &
Tate's own scheme. ``semi_discrete`` is their beam, ``hybrid_system`` the equations of each phase, ``exponential`` and
``propagators`` two unrelated ways to integrate them.
"""
