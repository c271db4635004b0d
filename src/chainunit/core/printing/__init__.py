"""The operations of traced equations, and their printers: one for each language, from the same list."""
