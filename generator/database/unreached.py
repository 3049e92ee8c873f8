"""Why a PostgreSQL server was not reached, and the way out.

The driver reports a failed connection by words alone, those of libpq and of the server; only
statements on an open connection have codes (`transaction.py`). A server that speaks another
language than English is quoted as it is.
"""

from __future__ import annotations

from sqlalchemy import URL

from generator.errors import DatabaseError


def connection_error(said: str, url: URL, place: str) -> DatabaseError:
    """Return the error for a connection that was not made.

    Parameters
    ----------
    said
        All that the driver says, one line per address that was tried.
    url, place
        The database, and how messages name it.
    """
    server = f"{url.host or 'this computer'}{f':{url.port}' if url.port else ''}"
    for phrases, cause, fix in _MEANINGS:
        if any(phrase in said for phrase in phrases):
            names = {"server": server, "name": url.database or "", "user": url.username or ""}
            return DatabaseError(cause.format(**names), fix=fix.format(**names), place=place)
    lines = said.strip().splitlines() or ["the server gives no reason"]
    fix = "check that the server runs, and host, port, user and name in the URL"
    return DatabaseError(f"cannot connect: {lines[0]}", fix=fix, place=place)


_MEANINGS: tuple[tuple[tuple[str, ...], str, str], ...] = (
    (
        ("password authentication failed", "no password supplied"),
        "the server refuses the user '{user}' or the password",
        "correct them in the URL, or in PGUSER, PGPASSWORD and ~/.pgpass",
    ),
    (
        ('role "', "pg_hba.conf"),
        "the server does not let the user '{user}' in",
        "correct the user in the URL, or have the server's administrator add it",
    ),
    (
        ('database "',),
        "the server has no database '{name}'",
        "create it with: createdb {name}; or correct the name in the URL",
    ),
    (
        ("failed to resolve", "could not translate host name"),
        "there is no host '{server}'",
        "correct the host in the URL",
    ),
    (
        ("Connection refused", "No such file or directory"),
        "no PostgreSQL server runs on {server}",
        "start it, or correct host and port in the URL",
    ),
    (
        ("timeout", "timed out", "unreachable", "No route to host"),
        "the server on {server} does not answer",
        "check the network and the firewall, or correct host and port in the URL",
    ),
    (
        ("starting up", "shutting down", "too many clients", "remaining connection slots"),
        "the server on {server} takes no more connections now",
        "run the same command again in a moment",
    ),
)
