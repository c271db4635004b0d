"""Rating life of a pin: a rolling bearing in place of a pin, and how long it lasts in steady running."""
