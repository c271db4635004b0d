"""Recordings of real machines: their files, the inspection of their columns, and the fit of a simulated machine."""
