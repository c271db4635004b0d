"""FMUs from declared models. Nothing here names a machine."""
