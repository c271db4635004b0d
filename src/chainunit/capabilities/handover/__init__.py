"""Files for other programs: the numbers of a sized drive as JSON; cycle, candidates and checks as CSV."""
