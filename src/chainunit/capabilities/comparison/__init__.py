"""Comparison: two results of studies side by side."""
