"""Port URLs: what they mean, and what is said when one means nothing."""

import errno
import os
import pty
import tty
from contextlib import suppress

import pytest

from probe.errors import PortError
from probe.port import open_port
from probe.port.address import Address
from probe.port.serial_line import _explain_refusal
from probe.port.url import address_of


@pytest.mark.parametrize(
    ("url", "target", "options"),
    [
        ("serial:///dev/ttyACM0?baud=500000", "/dev/ttyACM0", {"baud": "500000"}),
        ("sim:", "", {}),
        ("sim:out/cube.stl?seed=3", "out/cube.stl", {"seed": "3"}),
        ("sim:lab.db#Cube/top?rate=5&seed=1", "lab.db#Cube/top", {"rate": "5", "seed": "1"}),
        ("sim:sqlite:///lab.db#Cube/1", "sqlite:///lab.db#Cube/1", {}),
        ("sim:postgresql://h/d?sslmode=require#Cube/1", "postgresql://h/d?sslmode=require#Cube/1",
         {}),
        ("file:touch.h5?speed=0&loop=1", "touch.h5", {"speed": "0", "loop": "1"}),
    ],
)  # fmt: skip
def test_urls_are_read(url, target, options):
    assert address_of(url) == Address(url, url.partition(":")[0], target, options)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("touch.h5", "write file:touch.h5"),
        ("serial:", "names no device"),
        ("file:?speed=1", "names no recording"),
        ("sim:?rate", "options 'rate' cannot be read"),
        ("sim:?rate=fast", "rate='fast' is no number from 0.1"),
        ("sim:?rate=0", "rate='0' is no number from 0.1"),
        ("sim:?rate=inf", "is no number"),
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


def test_a_device_that_is_not_there_names_those_that_are(tmp_path):
    with pytest.raises(PortError, match=r"there is no .*; plug the probe in; ports that are there"):
        open_port(f"serial://{tmp_path}/ttyACM7")


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
