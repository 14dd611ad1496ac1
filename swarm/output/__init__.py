"""Files, one module a format; heavy imports stay inside them."""
