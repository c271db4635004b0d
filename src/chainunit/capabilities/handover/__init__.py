"""Files for others: the sizing of a drive as an asset administration shell; cycle, candidates and checks as CSV."""
