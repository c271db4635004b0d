"""Linkages that other programs drew: one file for each format, and one that makes the tables of a linkage file."""
