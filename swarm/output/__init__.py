"""Files, one module a format; heavy imports stay inside them."""

import os

# Rerun's log has lines about a file that it cannot write, where an error is raised that says so in a sentence.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=off")
