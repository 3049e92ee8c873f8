"""Overlapping touches -> one image of the face, and where each touch stands. Thesis 4.3.

planar        poses in the plane of the face
touch         one touch with what is believed and what was decoded of its place
patch         its image, to be asked between the tactels
texture       which motions of an image would be seen
raster        images known in parts, on cells of a quarter of a tactel
correlation   normalised correlation of such images
product       the thesis's correlation, to compare with
search        the best few places in the window that a belief leaves
lucas_kanade  displacement, turn and gain by least squares
pair          one touch against another: found, or why not
graph         beliefs, steps, pairs and decoded places -> poses, robustly
canvas        the sums under the global image, laid tile by tile
image         the global tactile image with its uncertainty
mosaic        touches, poses, covariances, outliers: the value
place         where one touch more belongs
grow          one touch more, or all at once
"""
