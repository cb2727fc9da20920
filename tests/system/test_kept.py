"""FMUs of both versions give the same bits; bodies that are kept for the next run step as new ones, are few, and are
freed."""
