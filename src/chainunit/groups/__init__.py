"""The Assur groups of a linkage (crank, dyad, triad, hanging chain), their bodies and loads.

Kinematics run forward through the groups, forces run backward, last group first.
"""
