"""Independent references: the pair solved as one system. Shares only `scene` and `trajectory` with the package.

``event_driven`` integrates the laws `transmission` and `compliance` between located events; ``algorithm1`` is Ahn &
Tate's own scheme. ``semi_discrete`` is their beam, ``hybrid_system`` the equations of each phase, ``exponential`` and
``propagators`` two unrelated ways to integrate them.
"""
