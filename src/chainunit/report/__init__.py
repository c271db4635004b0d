"""The report on a study: a table on the terminal, result.json, result.nc, plots, a page that holds it all."""
