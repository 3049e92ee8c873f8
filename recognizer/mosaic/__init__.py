"""Overlapping touches -> one image of the face, and where each touch stands. Thesis 4.3.

planar        poses in the plane of the face
touch         one touch with what is believed and what was decoded of its place
patch         its image, to be asked between the tactels
correlation   normalised correlation of images that are known in parts
product       the thesis's correlation, to compare with
lucas_kanade  displacement, turn and gain by least squares
pair          one touch against another: found, or why not
graph         beliefs, pairs and decoded places -> poses, robustly
covariance    how sure poses are
canvas        the sums under the global image, laid tile by tile
image         the global tactile image with its uncertainty
grow          one touch more
build         all touches at once
"""
