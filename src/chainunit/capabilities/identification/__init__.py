"""Identification: masses, friction and feed of a real machine from recordings of its motor."""
