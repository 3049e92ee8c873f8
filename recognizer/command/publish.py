"""Images and answers to whoever listens: `--publish zenoh://HOST:PORT[/KEY]`.

::

    KEY/image     application/cdr;sensor_msgs/msg/Image    every image, at the sensor's rate
    KEY/answer    application/json                         every answer, as --json prints it
    KEY/object    application/cdr;geometry_msgs/msg/PoseWithCovarianceStamped

KEY is `touch` if left out. Images are dropped, at the publisher, for a client that is too slow for
them. Answers wait for their clients in a thread of their own; the last ones are kept for clients
that come late or lose the line (zenoh's advanced subscribers fetch them).

Clients listen and ask for what was sent, nothing else: what they send themselves is passed on to
nobody. Beyond this machine they give a name and a password, unless it is open to all. Nothing is
encrypted or signed.
"""

from __future__ import annotations

import json
import queue
import re
from pathlib import Path
from threading import Thread
from typing import Any, Final

from encoded_objects.base.errors import EncodedObjectsError, require
from encoded_objects.base.network import is_loopback
from encoded_objects.base.output import json_value, message, warning
from probe.frame import Frame
from probe.recording.ros import IMAGE, POSE_WITH_COVARIANCE, cdr_bytes, image_message
from recognizer.command.answers import Answer, AnswerSink
from recognizer.command.ros import object_message

_URL = re.compile(
    r"zenoh://(?P<host>[\w.-]+|\[[0-9a-fA-F:]+\]):(?P<port>\d{1,5})(?:/(?P<key>[\w./-]+))?"
)
QUEUE: Final = "transport/link/tx/queue"
KEY: Final = "touch"
KEPT: Final = 1000  #: answers that late clients can fetch
SEND_BUFFER: Final = 65_536  #: bytes of the socket: 60 images, a quarter of a second
TIMEOUT_S: Final = 60.0  #: for a client that takes no answer, before its line is cut


class PublishSink(AnswerSink):
    """A zenoh session that listens at a port.

    Parameters
    ----------
    url
        Where it listens.
    users
        A file with a line NAME:PASSWORD for each client; None: nobody is asked.
    to_all
        Whether it may listen beyond this machine without `users`.

    Raises
    ------
    EncodedObjectsError, MissingExtraError
        The URL is none, or reached by others who are not asked for a password; the users cannot be
        read, the port is taken, or zenoh is not installed.
    """

    def __init__(self, url: str, users: Path | None = None, *, to_all: bool = False) -> None:
        endpoint, self.key = endpoint_of(url)
        away = not is_loopback(endpoint.removeprefix("tcp/").rpartition(":")[0])
        if away and users is None and not to_all:
            raise EncodedObjectsError(
                "others than this machine reach this address, and could read all that is sent",
                fix="publish at zenoh://127.0.0.1:7447/touch, ask for passwords by --publish-users "
                "FILE, or let everybody read: --open",
                place=url,
            )
        config = _config(endpoint, self.key)
        if users is not None:
            config.insert_json5("transport/auth/usrpwd/dictionary_file", _users(users))
        require("zenoh", extra="robot", purpose="--publish")
        import zenoh
        from zenoh import CongestionControl, Encoding, Priority, ext

        try:
            self._session = zenoh.open(config)
        except zenoh.ZError as error:
            raise EncodedObjectsError(
                "nothing can be published there", fix="take another port; is this one free?",
                place=url,
            ) from error  # fmt: skip
        cdr = Encoding.APPLICATION_CDR.with_schema
        self._images = self._session.declare_publisher(
            f"{self.key}/image", encoding=cdr(IMAGE), priority=Priority.DATA_LOW,
            congestion_control=CongestionControl.DROP,
        )  # fmt: skip
        reliable: dict[str, Any] = {
            "priority": Priority.INTERACTIVE_HIGH,
            "congestion_control": CongestionControl.BLOCK,
            "express": True,  # at once, in no batch
            "cache": ext.CacheConfig(max_samples=KEPT),
            "sample_miss_detection": ext.MissDetectionConfig(
                heartbeat=1.0, sporadic_heartbeat=None
            ),
            "publisher_detection": True,
        }
        self._answers = ext.declare_advanced_publisher(
            self._session, f"{self.key}/answer", encoding=Encoding.APPLICATION_JSON, **reliable
        )
        self._objects = ext.declare_advanced_publisher(
            self._session, f"{self.key}/object", encoding=cdr(POSE_WITH_COVARIANCE), **reliable
        )
        self._waiting: queue.SimpleQueue[tuple[Any, bytes] | None] = queue.SimpleQueue()
        self._thread = Thread(target=self._send_waiting, name="publish", daemon=True)
        self._thread.start()
        message(f"publishing {self.key}/image, /answer and /object at {endpoint}")
        if away and users is None:
            warning(f"--open: everybody who reaches {endpoint} reads images, answers and poses; "
                    "nothing is encrypted or signed")  # fmt: skip

    def frame(self, frame: Frame) -> None:
        """Publish an image; it is dropped for clients that are busy with earlier ones."""
        self._images.put(cdr_bytes(IMAGE, image_message(frame)))

    def answer(self, answer: Answer) -> None:
        """Publish an answer, and where the object is."""
        self._waiting.put((self._answers, json.dumps(json_value(answer.as_json())).encode()))
        placed = object_message(answer.found, answer.in_base, answer.touch.t_ns)
        if placed is not None:
            self._waiting.put((self._objects, cdr_bytes(POSE_WITH_COVARIANCE, placed)))

    def close(self) -> None:
        """Send the answers that wait, and end the session."""
        if self._thread.is_alive():
            self._waiting.put(None)
            self._thread.join(TIMEOUT_S)
            self._session.close()  # type: ignore[no-untyped-call, unused-ignore]

    def _send_waiting(self) -> None:
        while (item := self._waiting.get()) is not None:
            publisher, payload = item
            publisher.put(payload)


def endpoint_of(url: str) -> tuple[str, str]:
    """Return zenoh's endpoint of a URL, and the key.

    >>> endpoint_of("zenoh://127.0.0.1:7447/bench/1")
    ('tcp/127.0.0.1:7447', 'bench/1')
    """
    match = _URL.fullmatch(url)
    key = KEY if match is None else (match["key"] or KEY).strip("/")
    if match is None or not 0 < int(match["port"]) < 65536 or "//" in key or not key:
        raise EncodedObjectsError(
            "this is no place to publish at", fix="write zenoh://127.0.0.1:7447/touch", place=url
        )
    return f"tcp/{match['host']}:{match['port']}", key


def _users(path: Path) -> str:
    """Return the name of a file of users, as JSON, after a look into it."""
    try:
        lines = path.read_text("utf-8").splitlines() if path.is_file() else []
    except (OSError, UnicodeDecodeError):
        lines = []
    if not lines or not all(re.fullmatch(r"[^:\s]+:\S{8,}", line) for line in lines):
        raise EncodedObjectsError(
            "this is no list of users", place=str(path),
            fix="write a line NAME:PASSWORD for each, passwords of 8 characters or more",
        )  # fmt: skip
    return json.dumps(str(path.absolute()))


def _access(key: str) -> dict[str, Any]:
    """Return who may do what: clients subscribe and ask under the key, and get what we send."""
    keys = [f"{key}/**", f"{key}/**/@adv/**"]  # `@adv`: of advanced publishers, no ** takes it
    sent = ["put", "delete", "reply", "liveliness_token"]
    asked = ["declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [
            {"id": flow, "permission": "allow", "flows": [flow], "messages": messages,
             "key_exprs": keys}
            for flow, messages in (("egress", sent), ("ingress", asked))
        ],
        "subjects": [{"id": "all"}],
        "policies": [{"rules": ["egress", "ingress"], "subjects": ["all"]}],
    }  # fmt: skip


def _config(endpoint: str, key: str) -> Any:
    """Return a session that listens there alone, looks for nobody, and keeps little for images."""
    import zenoh

    config = zenoh.Config()
    for path, value in (
        ("mode", "peer"),
        ("listen/endpoints", [f"{endpoint}#so_sndbuf={SEND_BUFFER}"]),
        ("access_control", _access(key)),
        ("scouting/multicast/enabled", False),
        ("scouting/gossip/enabled", False),  # clients do not learn of each other here
        ("timestamping/enabled", True),
        (f"{QUEUE}/size/data_low", 1),
        (f"{QUEUE}/congestion_control/block/wait_before_close", int(1e6 * TIMEOUT_S)),
    ):
        config.insert_json5(path, json.dumps(value))
    return config
