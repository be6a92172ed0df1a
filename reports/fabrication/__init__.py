"""The page of what is built: pictures of the written files, their list, and how to make them."""
