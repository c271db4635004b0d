"""Native code from traced equations: operations, C functions, compilers and the cache of compiled code."""
