"""A mechanism as data, and the two models of it: motion in and torque out, torque in and motion out."""
