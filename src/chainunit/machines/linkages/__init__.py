"""Machines whose linkage a file describes."""
