"""One touch: its signal, the symbols in it, the place they name, the pose, and how sure it is.

::

    signal       readings -> forces and trust        contacts   frames -> touches
    symbols/     image -> lattices with the likelihood of every symbol in every cell
    lab          database -> the registered cells; windows   index of them by their labels
    locate       lattice -> places of the database
    verify       the best places again, with what the database says is there; round   on mantles
    belief       whether the best place may be believed
    pose         where the sensor stands on face and object; robot   the object in the robot's base
    recognise    all of it, one after another; reader   what is prepared once for lab and sensor
    recognition  the answer

Thesis 6.3.
"""
