"""Pictures of a run: plots, animation, and the report that opens in a browser.

Imports `results` and `scene` only. ``panels`` says what is drawn over time and ``frames`` what moves; ``timeline``,
``plots`` and ``animation`` draw it with matplotlib, ``report`` with plotly. ``drawing`` holds looks, units and scales.
Start at ``panels``.
"""
