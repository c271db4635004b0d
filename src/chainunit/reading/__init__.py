"""Tables, numbers and texts, as people write and read them."""
