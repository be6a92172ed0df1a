"""From recordings to the constants of a specimen, with what is known of their errors."""
