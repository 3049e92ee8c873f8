"""One touch: its signal, the symbols in it, the place they name, the pose, and how sure it is.

::

    reader        Reader(open_lab("lab.db")): read(counts), read_all(recording)
    options       the numbers that a user may turn
    source        recording -> touches, sensor, calibration
    signal        readings -> forces and trust
    symbols/      image -> lattices with the likelihood of every symbol in every cell
    lab           database -> the registered cells, and an index of windows by their labels
    prepare       templates and banks of lattices, once for lab and sensor
    hypothesis    a place of the database, and the score of cells there; lattice -> places
    verify        the best of them again, with the registered symbols; flat and round faces
    evidence      what the image says of a place
    chance        expected false matches, by symbols and by the border of the face
    verdict       evidence and expected false matches -> answer, or the reason for none
    search_gate   whether a wide search may change the answer
    pose          where the sensor stands on face and object; robot   the object in the robot's base
    recognise     all of it, one after another; recognition   the answer
    diagnose      what of a touch made it fail; next_touch   where to touch next

Thesis 6.3.
"""
