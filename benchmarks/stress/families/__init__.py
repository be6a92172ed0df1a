"""One file per family of cases; each has a function ``family`` that returns it."""
