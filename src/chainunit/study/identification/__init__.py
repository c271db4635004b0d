"""Identification of a real machine from recordings of its motor."""
