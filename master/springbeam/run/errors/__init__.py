"""Errors of the ends of a run, to first order: one file for each cause, and the answer of the ends to all of them.

``soft`` is the force of steps that miss a soft law, ``tie`` the gap that ties leave inside steps, ``loads`` what steps
leave out of loads, ``strokes`` the times of impacts on the foundation. ``ends`` says how both ends answer;
`springbeam.run.misplaced` adds everything up (``docs/coupling.md``, "How far ends are misplaced").
"""
