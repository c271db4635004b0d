"""FMUs from declared models. No module here names a machine."""
