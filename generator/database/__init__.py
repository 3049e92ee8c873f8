"""The lab's database: which object holds which cells of which array (Thesis 6.3, figure 6.16).

::

    open          file or URL -> Engine, its schema made, checked, or brought up to date
    tables        the schema, with its version history
    migrate       an older schema -> this one, whole or not at all (migrations/vN.py)
    transaction   writers one after another, readers on one state; what failures mean
    register      an object -> its rows, all or none; an object out of use
    rows          polyhedron and layout -> rows
    read          rows -> entries, objects and layouts, bit for bit
    registered    an object as values
    cells         which cells are taken, and by which object and face
    lab           the lab's key, its arrays and how full they are
    transfer      objects of one database -> another one, checked against the array
    exchange      export to a file, import from one
    as_built      how prints came out, as touches measured it
    part_file     files of parts: whether they are there and unchanged, their triangles
    round_face    the plane that touches a registered round face
"""

from generator.errors import DatabaseError

__all__ = ["DatabaseError"]
