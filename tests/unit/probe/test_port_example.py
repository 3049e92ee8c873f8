"""The example of a package that adds a port: found by its entry point, read as any probe."""

from __future__ import annotations

import socket
import threading
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest

from probe.client.client import Client
from probe.errors import PortError
from probe.port.url import GROUP, open_port, typed_port

EXAMPLE = Path(__file__).parents[3] / "docs/examples/udp_probe"


@pytest.fixture
def udp(tmp_path, monkeypatch):
    """Install the package as pip would, and yield a free port of this machine."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    info = tmp_path / "udp_probe-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: udp-probe\nVersion: 1.0\n")
    entries = project["entry-points"][GROUP].items()
    text = "".join(f"{scheme} = {opener}\n" for scheme, opener in entries)
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{text}lost = no_such_module:Port\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.syspath_prepend(EXAMPLE)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def test_images_of_another_package_are_frames(udp):
    images = np.random.default_rng(1).integers(0, 4096, (6, 8, 8)).astype("<u2")
    url = f"udp://127.0.0.1:{udp}?sensor_type=fsr-8x8"
    assert typed_port(url)[1].name == "fsr-8x8"
    stop = threading.Event()

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not stop.is_set():
                for image in images:
                    out.sendto(image.tobytes(), ("127.0.0.1", udp))
                    time.sleep(0.005)

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    with Client(url) as client:
        frames = [frame for frame, _ in zip(client.frames(timeout_s=5), range(12), strict=False)]
        assert (client.ident.name, client.ident.rows) == ("udp", 8)
    stop.set()
    sender.join()
    assert len(frames) == 12
    known = {image.tobytes() for image in images}
    assert all(frame.counts.astype("<u2").tobytes() in known for frame in frames)


def test_it_refuses_as_ports_do(udp):
    with pytest.raises(PortError, match=r"cannot listen.*write udp://"):
        open_port("udp://127.0.0.1:port")
    with pytest.raises(PortError, match=r"no_such_module.*install it again"):
        open_port("lost:")
    with pytest.raises(PortError, match="sim:, file:, lost: or udp:"):
        open_port("http://probe")
    with pytest.raises(PortError, match="udp: has no option rows"):
        open_port(f"udp://127.0.0.1:{udp}?rows=8")
