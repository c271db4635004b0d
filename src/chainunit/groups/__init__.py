"""Assur groups: a driver and dyads, each written once.

Kinematics run forward through the groups, forces run backward, last group first.
"""
