"""Sweep: quantities of a turn and measures of runs over parameters of the study, at many points."""
