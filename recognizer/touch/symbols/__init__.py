"""Image -> symbols: one maximum-likelihood fit of pose, gain and every visible symbol.

template    what the sensor feels of each symbol, through the overlay; pad   pressed once
pressing    depth of the plate -> force; gain   the image under a plane of depths
noise       how far readings may lie from what a symbol gives
search      coarse: all rotations and shifts of the lattice at once, one matrix product
projection  what lies under the tactels: cells, templates, labels
refine      fine: damped least squares over pose and gain, labels chosen anew at every step
covariance  how sure the pose is
kernels     the library of compiled loops, where it is there; compiled   those over an image
fit         all of it, and the scores of every cell; bends   a round face by forces alone
"""
