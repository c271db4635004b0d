"""Optimize: parameters of the machine that make one or two quantities of a turn least, within limits."""
