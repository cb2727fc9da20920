"""Pictures of a run: plots, animation, and the report that opens in a browser.

Imports `results` and `scene` only. ``drawing`` holds looks, units and scales that all of them share, ``timeline`` the
axes over time and ``frames`` the run as it moves. Start at ``plots``.
"""
