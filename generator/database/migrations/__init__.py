"""One module per schema version: how a database of the version before becomes one of it.

`vN.py` has `upgrade(operations)`, where `operations` are Alembic's on the connection of a
`writing` transaction. A module is history: it names tables and columns as they were then and
imports nothing of `tables.py`, which goes on. On SQLite columns and tables are added and never
rebuilt: dropping the old table would, with foreign keys on, remove the rows that refer to it.
"""
