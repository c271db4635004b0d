"""The report on a study: tables on the terminal, result.json, result.nc, plots, and a page with all of them."""
