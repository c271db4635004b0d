"""What all layers stand on: quantities, models, engines, vectors of the plane, load port, integrators, printers,
units, files and errors."""
