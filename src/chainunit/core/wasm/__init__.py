"""WebAssembly modules of models, written byte by byte from the same operations as the C code."""
