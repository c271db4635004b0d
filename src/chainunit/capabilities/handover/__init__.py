"""Files for others: the sizing of a drive as an asset administration shell, and its cycle and candidates as CSV."""
