"""Printers of traced equations: one for each language, from the same list of operations."""
