"""FMUs from declared models, and the loading of the libraries of FMUs. No module here names a machine."""
