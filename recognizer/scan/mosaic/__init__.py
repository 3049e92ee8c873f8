"""Overlapping touches -> one image of the face, and the pose of each touch. Thesis 4.3.

planar      poses in the plane of the face, and their sources for each touch
patch       the image of a touch as a function, and its visible motions
search      the best places on a reference image, by normalised correlation
register    one touch against another by least squares
pose_graph  beliefs, steps, registrations and decoded places -> poses, robustly
canvas      the global tactile image
mosaic      touches with poses and covariances; the place of one more touch
"""
