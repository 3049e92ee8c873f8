"""Image -> symbols: one maximum-likelihood fit of pose, gain and every visible symbol.

template    what the sensor feels of each symbol, through the overlay that is fitted
search      coarse: all rotations and shifts of the lattice at once, one matrix product
refine      fine: Gauss-Newton over pose and gain, labels chosen anew at every step
fit         the two together, and the scores of every cell
"""
