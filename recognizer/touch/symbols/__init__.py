"""Image -> symbols: one maximum-likelihood fit of pose, gain and every visible symbol.

template    the response of the sensor to each symbol, through the overlay
kernels     the compiled loops, and the numbers that they use
image       the image that is fitted, and its gain: depth of the plate -> force
search      coarse: all rotations and shifts of the lattice at once, one matrix product
linearize   forces of known symbols, and their derivatives by pose and gain
fit         refinement of candidates, scores of every cell, covariance
posterior   the last fit of a pose whose symbols are known, and the share it explains
stretch     of the lattice of one touch; curvature   of a round face, from forces alone
"""
