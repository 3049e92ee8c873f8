"""One touch: its signal, the symbols in it, the place they name, the pose, and how sure it is.

::

    reader       Reader(open_lab("lab.db")): read(counts), read_all(recording)
    settings     every number that decides
    source       recording -> touches, sensor, calibration; contacts   frames -> touches
    signal       readings -> forces and trust
    symbols/     image -> lattices with the likelihood of every symbol in every cell
    lab          database -> the registered cells; windows   index of them by their labels
    prepare      templates and banks of lattices, once for lab and sensor
    hypothesis   a place of the database, and what cells say of it
    locate       lattice -> hypotheses: places of the database
    verify       the best of them again, with what the database says is there; round   on mantles
    belief       whether the best hypothesis may be believed
    pose         where the sensor stands on face and object; robot   the object in the robot's base
    recognise    all of it, one after another; recognition   the answer

Thesis 6.3.
"""
