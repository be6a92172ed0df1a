"""From a design to drawings, meshes and fixtures: what a lab cuts, prints and assembles."""
