"""The live machine of a page: its equations in JavaScript, its quantities, and what the page computes with them."""
