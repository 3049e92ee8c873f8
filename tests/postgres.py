"""A PostgreSQL server of its own on loopback, gone when whoever started it is gone.

    python tests/postgres.py [--durable]

Prints its URL, serves until its standard input ends, then removes everything. Debian's
`postgresql` must be installed; a server refuses root, so it runs as user postgres then.
Without `--durable` nothing is forced to the disk, which tests do not need.
"""

import argparse
import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

INSTALLED = Path("/usr/lib/postgresql")
MISSING = "PostgreSQL's server is not installed: apt-get install postgresql"
FAST = ("-F", "-c", "full_page_writes=off", "-c", "synchronous_commit=off")


@contextmanager
def running(*options: str) -> Iterator[str]:
    """Yield the URL of a server of this script's own; its absence is an error."""
    command = [sys.executable, __file__, *options]
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen(command, text=True, **pipes) as server:
        try:
            url = server.stdout.readline().strip()
            if not url:
                raise RuntimeError(server.stderr.read().strip())
            yield url
        finally:
            server.stdin.close()
            server.wait(timeout=60)


def execute(server: str, statement: str) -> None:
    import psycopg

    with psycopg.connect(server, autocommit=True) as connection:
        connection.execute(statement)


def new_schema(server: str, name: str) -> str:
    """Make an empty schema, which costs a hundredth of a database; return its URL."""
    execute(server, f"CREATE SCHEMA {name}")
    return f"{server}?options=-csearch_path%3D{name}"


def programs() -> Path:
    """Return the folder of the newest installed server."""
    found = [path.parent for path in INSTALLED.glob("*/bin/initdb")]
    if not found:
        sys.exit(MISSING)
    return max(found, key=lambda folder: int(folder.parent.name))


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--durable", action="store_true", help="force commits to the disk")
    durable = options.parse_args().durable
    binaries = programs()
    folder = Path(tempfile.mkdtemp(prefix="postgres-"))
    user: dict[str, object] = {"cwd": folder}
    if os.geteuid() == 0:
        server = pwd.getpwnam("postgres")
        os.chown(folder, server.pw_uid, server.pw_gid)
        user |= {"user": server.pw_uid, "group": server.pw_gid, "extra_groups": []}
    # Ctrl-C in the terminal is for the tests; the server ends when they close our input.
    signal.signal(signal.SIGINT, lambda *_: None)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    user["start_new_session"] = True
    port, data, log = free_port(), folder / "data", folder / "log"
    server = None
    try:
        make = ["-D", data, "-A", "trust", "-U", "postgres", "-E", "UTF8"]
        make += ["--locale=C", "--no-sync"]
        done = subprocess.run([binaries / "initdb", *make], capture_output=True, text=True, **user)
        if done.returncode:
            sys.exit(f"initdb failed: {done.stderr}")
        command = [binaries / "postgres", "-D", data, "-h", "127.0.0.1", "-p", str(port)]
        command += ["-k", "", *(() if durable else FAST)]
        with open(log, "wb") as messages:
            server = subprocess.Popen(command, stdout=messages, stderr=messages, **user)
        ready = [binaries / "pg_isready", "-q", "-t", "1", "-h", "127.0.0.1", "-p", str(port)]
        while subprocess.run(ready, check=False).returncode:
            if server.poll() is not None:
                sys.exit(f"the server ended: {log.read_text()}")
            time.sleep(0.05)
        print(f"postgresql://postgres@127.0.0.1:{port}/postgres", flush=True)
        sys.stdin.read()
        return 0
    finally:
        if server is not None and server.poll() is None:
            server.send_signal(signal.SIGINT)  # ends at once, without waiting for clients
            try:
                server.wait(timeout=30)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
