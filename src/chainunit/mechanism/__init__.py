"""A mechanism as data, and its two models: the inverse one (motion in, torque out) and the direct one (torque in,
motion out)."""
