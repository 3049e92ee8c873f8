"""Several touches read by the joint fit as one belief: object, face and pose. Thesis 4.3, 6.3.

Where one touch shows too few symbols, the touches of a scan together show enough. Each is fitted by
itself, arm and mosaic identify their common cells, and the accumulated evidence of all touches is
located like a single touch.

mosaic   overlapping touches -> one image and the pose of each
views    touch -> its few possible lattices; poses of touches in a plane
lattice  views -> the lattice that most agree with, and the evidence of each cell
path     poses of touches without measured motion, through registered places
belief   the belief of one face and its answer: `begin_scan`, `extend_scan`
session  `Scan`: counts and poses in, the answer of all faces out
"""
