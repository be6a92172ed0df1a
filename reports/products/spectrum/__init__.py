"""Shows small vibrations: modes, transmission, waves in the unit cell."""
