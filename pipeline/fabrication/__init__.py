"""Makes drawings, meshes, fixtures and papers of a design, for a lab to cut and assemble."""
