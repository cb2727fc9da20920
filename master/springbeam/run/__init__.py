"""A run: macro steps from event to event, its ledger and its rows.

Imports everything below: `coupling`, `contact`, `bodies`, `results`, `scene`. ``runner`` makes the parts of a scene and
runs them, ``master`` is the loop (start there), ``stepping`` one step and the state of the run, ``detection`` and
``separation`` the event that ends it, ``macro_steps`` its size, ``log`` what is handed over, ``ledger`` what judges the
energy.
"""
