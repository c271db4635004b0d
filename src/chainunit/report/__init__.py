"""What a study leaves behind: a table on the terminal, result.json, result.nc, plots."""
