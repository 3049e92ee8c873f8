"""One thread for the linear algebra: tests run side by side, and times mean CPU.

Databases of either engine: SQLite files, and a PostgreSQL server of this run's own.
"""

import os
import signal
import tempfile
from contextlib import ExitStack, contextmanager
from itertools import count
from pathlib import Path

import postgres
import pytest

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# A shell starts what runs in its background deaf to Ctrl-C, and so would be what tests interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ENGINES = ("sqlite", "postgresql")
NUMBERS = count(1)  # of schemas on the server


def pytest_xdist_auto_num_workers():
    """Run one more than there are cores: tests wait for pages, servers and processes."""
    return (os.cpu_count() or 1) + 1


@pytest.fixture(scope="session", autouse=True)
def one_lab_key():
    """Draw the same key for every new database of this process: the same arrays in every run."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("generator.array.lab_key.token_bytes", bytes)
        yield


@pytest.fixture
def ask(capsys):
    """Run a command in this process: code, stdout, stderr."""

    def ask(command, *words):
        capsys.readouterr()
        code = command([str(word) for word in words])
        return code, *capsys.readouterr()

    return ask


@pytest.fixture(scope="session")
def postgresql_server():
    """URL of a real server; its absence is a failure, so that nothing goes untested."""
    with postgres.running() as url:
        yield url


@pytest.fixture(scope="session")
def database_on(request):
    """Return a context manager: engine -> URL of a new, empty database, gone at its end."""

    @contextmanager
    def made(engine):
        if engine == "sqlite":
            with tempfile.TemporaryDirectory() as folder:
                yield str(Path(folder) / "lab.db")
            return
        server = request.getfixturevalue("postgresql_server")
        name = f"lab{next(NUMBERS)}"
        yield postgres.new_schema(server, name)
        postgres.execute(server, f"DROP SCHEMA {name} CASCADE")

    return made


@pytest.fixture
def new_database(database_on):
    """Return a function that names a new, empty database of an engine."""
    with ExitStack() as made:
        yield lambda engine: made.enter_context(database_on(engine))


@pytest.fixture(params=ENGINES)
def lab_url(request, new_database):
    """URL of an empty database; the test runs once on each engine."""
    return new_database(request.param)
