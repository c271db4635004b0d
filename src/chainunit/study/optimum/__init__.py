"""The best machine: parameters with the least objective under constraints, by exact derivatives and many starts."""
