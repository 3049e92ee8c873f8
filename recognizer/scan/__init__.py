"""Several touches read by the joint fit as one belief: object, face and pose. Thesis 4.3, 6.3.

Where one touch shows too few symbols, the touches of a scan show enough. Each of them is fitted
by itself; arm and mosaic say which cells are the same; what all touches say of a cell is added
up, and the sum is located like a single touch.

settings    when touches agree and how much they may say
views       touch -> the few lattices that it may show, and where the touch stands
lattice     views -> the lattice of the plane that most of them agree with
steps       what is known of steps, and what the touches themselves leave open
path        views of touches whose steps nobody measured -> where they stand in the array
composite   what they say of each cell, summed into one fit
answer      composites -> places of the database -> Recognition
belief      what the touches of a face say, and what it rests on
join        one touch and those before it, together
grow        one touch more of a face: `begin_scan`, `extend_scan`, `read_scan`
faces       what the touches of several faces say of the object, joined
session     `Scan`: counts and poses in, the belief so far out
"""
