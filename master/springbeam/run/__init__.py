"""A run: macro steps from event to event, its ledger and its rows.

Imports everything below: `coupling`, `contact`, `bodies`, `results`, `scene`. ``setup`` resolves what is run, and
behind it no module asks the scene. ``runner`` makes the bodies, which ``validation`` checks, and runs them, ``master``
is the loop (start there), ``stepping`` one step and the state of the run, ``loads`` the loads on it, ``detection`` the
event that ends it, ``macro_steps`` its size, ``log`` the records and their checks, ``ledger`` the energy balance,
``outcome`` progress and an early end. ``summary`` has the results of a run, with ``peaks`` and ``contradictions``.
``simulate`` runs and judges a scene, ``companion`` measures errors, ``accuracy`` refines until they are small.
"""
