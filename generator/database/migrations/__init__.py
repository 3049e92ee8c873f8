"""One module per schema version: how a database of the version before becomes one of it.

`vN.py` has `upgrade(connection)`, which runs in a write transaction. A module is history: it names
tables and columns as they were then and imports nothing of `tables`. On SQLite columns and tables
are added and never rebuilt: dropping the old table would, with foreign keys on, remove the rows
that refer to it.
"""
