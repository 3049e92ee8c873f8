"""Parts and layouts -> files: STEP, STL, 3MF, GLB, PNG and SVG, written all or none."""
