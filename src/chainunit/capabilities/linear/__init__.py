"""The linear model as a command: A, B, C, D of a drive, a linkage or a model at a point."""
