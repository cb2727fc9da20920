"""``python -m springbeam`` is the ``springbeam`` command."""

from .cli import main

main()
