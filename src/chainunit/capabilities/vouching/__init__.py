"""What is known about an FMU or an SSP package, written into it and signed; and the check of a signed one."""
