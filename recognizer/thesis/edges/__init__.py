"""Edges and corners of faces in a tactile image. Thesis 4.3, appendix 3.

points     Sobel, thinned -> places where what is felt begins, with directions
hough      adaptive Hough transform -> line segments, the longest first
line       edges and corners as values, and the straight line through points
syntax     production rules: segments -> edges, edges -> vertices
response   what tactels feel beside an edge, through the overlay
fit        edges moved until the touch's own readings are explained, with covariance
find       all of it: image -> edges, corners, and the part of a touch that is on the face

`recognize-object --method thesis` says which edges every touch feels; in Python
`find.touch_edges(sensor, signal)`, or `find.face_edges` of an image.
"""
