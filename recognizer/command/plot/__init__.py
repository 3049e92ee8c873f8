"""Pictures of a recognition, loaded when one is asked for. Thesis figures 6.17 to 6.19.

touch       the picture: three panels and a line of text
winning     the lattice that explains a touch best
symbols     the touch with the fitted symbols on it
window      the window on the array
wireframe   the object's wireframe with the probe on it
"""
