"""C compilers, and the cache of compiled code."""
