"""The page on what designs gain that hold against more than the study asks for."""
