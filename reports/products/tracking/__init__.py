"""Shows a track on its video, with its quality."""
