"""What all layers stand on: quantities, models, engines, vectors of the plane, load port, integrators, native code,
units, files and errors."""
