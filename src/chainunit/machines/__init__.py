"""Machines: a crank followed by Assur groups. No module here knows what an FMU is."""
