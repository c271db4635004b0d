"""The live machine of a page: its equations as WebAssembly, its quantities, and what the page computes with them."""
