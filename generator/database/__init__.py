"""The lab's database: which object holds which cells of which array (Thesis 6.3, figure 6.16).

::

    open.py         file or URL -> Engine, with the schema made or checked
    tables.py       the schema, with its version history
    transaction.py  writers one after another, readers on one state; what failures mean
    register.py     an object -> its rows, all or none
    read.py         rows -> objects and layouts, bit for bit
    cells.py        which cells are taken, and by which object and face
"""
