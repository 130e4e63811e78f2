"""Another user of the machine at the ports of a local cluster: refused without the cluster's key."""

from __future__ import annotations

import os
import socket
import ssl
import time
import urllib.error
import urllib.request
from pathlib import Path

import psutil
import pytest

from palpate.sweeps import LocalCluster


def listening(pid: int) -> list[int]:
    return [c.laddr.port for c in psutil.Process(pid).net_connections("tcp") if c.status == "LISTEN"]


@pytest.fixture
def ports(cluster: LocalCluster) -> list[int]:
    """All ports that scheduler and workers listen at, those of their empty pages included."""
    until = time.monotonic() + 20
    while any(len(listening(pid)) < 2 for pid in cluster.process_ids) and time.monotonic() < until:
        time.sleep(0.05)
    scheduler = int(cluster.address.rpartition(":")[2])
    return [scheduler, *(port for pid in cluster.process_ids for port in listening(pid))]


def handshake(port: int, security: object) -> bytes:
    """What the other side says to a connection that shows a key; "" or an error where it refuses."""
    if security is None:
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    else:
        context = security.get_connection_args("client")["ssl_context"]  # type: ignore[attr-defined]
    with (
        socket.create_connection(("127.0.0.1", port), timeout=5) as plain,
        context.wrap_socket(plain) as secret,
    ):
        return secret.recv(8)


def status(port: int, path: str) -> int:
    """The answer to a plain request for a page; 0 where none is understood."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/{path}", timeout=5) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


def test_who_has_the_key_is_let_in_and_nobody_else(cluster: LocalCluster, ports: list[int]):
    from distributed import Security

    assert cluster.address.startswith("tls://")
    inner = [port for port in ports if not status(port, "")]
    assert len(inner) == 1 + len(cluster)  # the scheduler and each worker
    stranger = Security.temporary()
    for port in inner:
        assert handshake(port, cluster.security)
        for key in (None, stranger):
            with pytest.raises((ssl.SSLError, ConnectionError)):
                handshake(port, key)
    for port in set(ports) - set(inner):  # Dask's ports for pages: they have none
        for path in ("", "health", "info/main/workers.html", "metrics", "json/counts.json", "statics/"):
            assert status(port, path) == 404


def test_a_client_of_dasks_without_the_key_is_refused(cluster: LocalCluster):
    import distributed

    for address in (cluster.address, cluster.address.replace("tls://", "tcp://")):
        security = distributed.Security.temporary() if address.startswith("tls") else None
        with pytest.raises((OSError, TimeoutError)):
            distributed.Client(address, security=security, timeout="300ms", set_as_default=False)


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")
def test_the_key_stands_in_no_command_line_environment_or_file(cluster: LocalCluster):
    secret = cluster.security.tls_worker_key.splitlines()[2].encode()
    for pid in (os.getpid(), *cluster.process_ids):
        for name in ("cmdline", "environ"):
            content = Path(f"/proc/{pid}/{name}").read_bytes()
            assert b"PRIVATE" not in content
            assert secret not in content
    folder = cluster.folder
    assert folder.stat().st_mode & 0o077 == 0
    assert not [path for path in folder.rglob("*") if path.is_file() and b"PRIVATE" in path.read_bytes()]
    assert "PRIVATE" not in f"{cluster!r} {cluster} {cluster.security!r}"
