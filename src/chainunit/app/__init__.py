"""The command line, and studies from Python."""
