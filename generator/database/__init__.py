"""The lab's database: which object holds which cells of which array (Thesis 6.3, figure 6.16).

::

    open.py         file or URL -> Engine, with the schema made, checked, or brought up to date
    engine.py       how SQLite and PostgreSQL are connected to
    tables/         the schema, with its version history
    migrate.py      an older schema -> this one, whole or not at all (migrations/vN.py)
    transaction.py  writers one after another, readers on one state; what failures mean
    unreached.py    why a server was not reached
    race.py         place and register in one transaction; who loses a race does it anew
    register.py     an object -> its rows, all or none
    retire.py       an object out of use, its cells kept or freed
    lab.py          the lab's key, and on which arrays its objects are made
    fullness.py     how full the arrays are, and how full before a touch is not enough
    entries.py      which objects there are: a line for each
    read.py         rows -> objects and layouts, bit for bit
    cells.py        which cells are taken, and by which object and face
    occupancy.py    taken cells as bits, in tiles, for the placing of the next object
    carry.py        objects of one database -> another one (carry_check.py: whether they may)
    exchange.py     export to a file, import from one
    as_built.py     how prints came out, as touches found it
    part_state.py   whether registered files are there and unchanged
    round_face.py   where a plane stands that touches a registered round face

Reading sees of `generator` this package, the array and the alphabet alone: what it needs to
know of a shape it has from `registered`.
"""

from generator.errors import DatabaseError

__all__ = ["DatabaseError"]
