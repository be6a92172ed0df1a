"""Shows what is built: pictures of the written files, and how to make them."""
