"""Pictures of a run: plots, animation, and the report that opens in a browser.

Imports `results` and `scene` only. ``panels`` selects the curves over time and ``frames`` the moving parts;
``timeline``, ``plots`` and ``animation`` draw them with matplotlib, ``report`` with plotly.js. ``drawing`` has looks,
units and scales. Start at ``panels``.
"""
