"""Port URLs: what they mean, and what is said when one means nothing."""

import errno
import os
import pty
import subprocess
import sys
import tty
from contextlib import suppress

import pytest

from probe.client import Client
from probe.errors import PortError
from probe.port import list_ports, open_port
from probe.port.address import Address, number
from probe.port.serial_line import _explain_refusal, open_serial
from probe.port.url import address_of


@pytest.mark.parametrize(
    ("url", "target", "options"),
    [
        ("serial:///dev/ttyACM0?baud=500000", "/dev/ttyACM0", {"baud": "500000"}),
        ("serial:/dev/ttyACM0", "/dev/ttyACM0", {}),
        ("sim:", "", {}),
        ("sim:?rate=220", "", {"rate": "220"}),
        ("sim:out/cube.stl?seed=3", "out/cube.stl", {"seed": "3"}),
        ("sim:lab.db#Cube/top?rate=5&seed=1", "lab.db#Cube/top", {"rate": "5", "seed": "1"}),
        ("sim:sqlite:///lab.db#Cube/1", "sqlite:///lab.db#Cube/1", {}),
        ("sim:postgresql://h/d?sslmode=require#Cube/1", "postgresql://h/d?sslmode=require#Cube/1",
         {}),
        ("file:touch.h5?speed=0&loop=1", "touch.h5", {"speed": "0", "loop": "1"}),
        ("file:///data/touch.h5", "/data/touch.h5", {}),
    ],
)  # fmt: skip
def test_urls_are_read(url, target, options):
    assert address_of(url) == Address(url, url.partition(":")[0], target, options)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("/dev/ttyACM0", "write serial:///dev/ttyACM0"),
        ("touch.h5", "write file:touch.h5"),
        ("http://probe", "must begin with serial:, flexitac:, sim: or file:"),
        ("serial:", "names no device"),
        ("file:?speed=1", "names no recording"),
        ("sim:?rate", "options 'rate' cannot be read"),
        ("sim:?rate=fast", "rate='fast' is no number from 0.1"),
        ("sim:?rate=0", "rate='0' is no number from 0.1"),
        ("sim:?rate=inf", "is no number"),
        ("sim:?bits=8", "sim: has no option bits; its options are rate, sensor_type"),
        ("file:touch.h5?rate=1", "its options are speed, loop"),
        ("file:touch.h5?speed=-1", "no number from 0"),
        ("serial:///dev/ttyACM0?boud=1", "serial: has no option boud"),
    ],
)
def test_urls_that_mean_nothing_are_refused(url, says):
    with pytest.raises(PortError) as refused:
        open_port(url)
    assert says in str(refused.value)
    assert refused.value.fix
    assert refused.value.exit_code == 3


@pytest.fixture
def another_package(tmp_path, monkeypatch):
    """A distribution on the path that opens echo:, and another whose module is gone."""
    (tmp_path / "echo_port.py").write_text(
        "class Echo:\n"
        "    def __init__(self, address):\n"
        "        self.url, self._waiting = address.url, address.options['say'].encode()\n"
        "    def read(self, timeout_s):\n"
        "        said, self._waiting = self._waiting, b''\n"
        "        return said\n"
        "    def write(self, data):\n"
        "        self._waiting += data\n"
        "    def close(self):\n"
        "        pass\n"
    )
    for name, module in (("echo", "echo_port:Echo"), ("lost", "no_such_module:Port")):
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        entry = f"[encoded_objects.ports]\n{name} = {module}\n"
        (info / "entry_points.txt").write_text(entry)
    monkeypatch.syspath_prepend(tmp_path)


def test_another_package_adds_a_scheme(another_package):
    port = open_port("echo:?say=hello")
    port.write(b"!")
    assert (port.url, port.read(0.1)) == ("echo:?say=hello", b"hello!")
    with pytest.raises(PortError, match="sim:, file:, echo: or lost:"):
        open_port("http://probe")
    with pytest.raises(PortError, match=r"no_such_module.*install it again"):
        open_port("lost:")


def test_numbers_have_defaults():
    assert number(address_of("sim:"), "rate", 100.0) == 100.0
    assert number(address_of("sim:?rate=2.5"), "rate", 100.0) == 2.5


def test_a_device_that_is_not_there_names_those_that_are(tmp_path):
    with pytest.raises(PortError, match=r"there is no .*; plug the probe in; ports that are there"):
        open_port(f"serial://{tmp_path}/ttyACM7")


def test_what_is_no_serial_line_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("no device")
    with pytest.raises(PortError, match="cannot be opened"):
        open_port(f"serial://{tmp_path}/notes.txt")


def test_a_second_client_is_refused(line):
    _, url = line
    first = open_port(url)
    with pytest.raises(PortError, match="in use by another programme; close it"):
        open_port(url)
    first.close()
    open_port(url).close()


def test_without_permission_the_group_is_named(tmp_path):
    device = tmp_path / "ttyACM0"
    device.touch()
    refused = _explain_refusal(address_of(f"serial://{device}"), OSError(errno.EACCES, "no"), 9600)
    assert f"no permission to open {device}" in refused.cause
    assert "usermod -a -G" in refused.fix


def test_a_baud_rate_that_is_none_is_refused(line):
    _, url = line
    with pytest.raises(PortError, match="no number from 1"):
        open_serial(address_of(url + "?baud=0"))


def test_bytes_go_both_ways_until_the_device_goes(line):
    master, url = line
    port = open_port(url)
    assert port.url == url
    assert port.read(0.01) == b""
    os.write(master, b"\x00\x01\x11\x13\r\n\xff")  # what a line must not change
    assert port.read(1.0) == b"\x00\x01\x11\x13\r\n\xff"
    port.write(b"s\r")
    assert os.read(master, 10) == b"s\r"
    os.close(master)
    with pytest.raises(PortError, match="went away"):
        port.read(1.0)
    port.close()
    port.close()


def test_ports_are_listed_likely_probes_first():
    entries = list_ports()
    assert all(entry.url == f"serial://{entry.device}" for entry in entries)
    assert [entry.likely for entry in entries] == sorted((e.likely for e in entries), reverse=True)


def test_libraries_load_when_a_port_is_opened():
    code = "import sys, probe.client, probe.port; print({'serial', 'h5py'} & set(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "set()\n"


def test_a_client_needs_a_buffer():
    with pytest.raises(PortError, match="a buffer of 0 frames"):
        Client("sim:", buffer=0)


@pytest.fixture
def line():
    """Yield the master of a pty, and the URL of its other end."""
    master, slave = pty.openpty()
    tty.setraw(master)
    name = os.ttyname(slave)
    os.close(slave)
    yield master, f"serial://{name}"
    with suppress(OSError):  # the test may have closed it
        os.close(master)
