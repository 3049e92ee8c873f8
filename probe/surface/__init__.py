"""What is touched, as heights: from a mesh, from symbols on a face, from an array."""
