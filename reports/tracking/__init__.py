"""What a track looks like on its video, and how good it is."""
