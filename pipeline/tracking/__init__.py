"""From the video of a specimen to the motions of its units; knows nothing of the simulation."""
