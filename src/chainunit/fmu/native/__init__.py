"""Native FMUs: the traced equations as C, wrapped in a small C layer, compiled."""
