"""Pictures per second of one page while others flood its server.

    python -m benchmarks.flooded_page [--seconds 3]

A page that asks for 75 pictures a second is measured alone, and beside each flood in turn. All stays on 127.0.0.1 and
lasts for a few seconds.
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import multiprocessing
import resource
import socket
import time
from collections.abc import Callable
from multiprocessing.synchronize import Event

import httpx
import numpy as np
from websockets.sync.client import ClientConnection, connect

from benchmarks.cases import touch_model
from palpate.viewer import Viewer
from palpate.viewer.messages import Credit, Hand

LONGEST = 30.0  # s
WANTED = 75.0  # pictures per second
HALF_OPEN = 1100

CREDIT = Credit(1).pack()
HAND = Hand(0.0, 0.05, (0.0, 0.1, 0.0), False, False, np.zeros(0, "f4")).pack()


def websocket_frame(content: bytes, kind: int = 2) -> bytes:
    """A client's frame, masked with zeros."""
    return bytes([0x80 | kind, 0x80 | len(content)]) + b"\0\0\0\0" + content


def flood_by_websocket(port: int, cookie: str, over: Event, frame: bytes) -> None:
    """Send the same frame without end, through a page's own websocket."""
    key = base64.b64encode(b"0" * 16).decode()
    with socket.create_connection(("127.0.0.1", port)) as line:
        line.sendall(
            f"GET /touch HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n"
            f"Cookie: {cookie}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        line.settimeout(0.1)
        many = websocket_frame(frame) * 2000 if frame else websocket_frame(b"", 9) * 2000
        while not over.is_set():
            with contextlib.suppress(TimeoutError):
                line.sendall(many)
            with contextlib.suppress(TimeoutError):
                if not line.recv(1 << 20):
                    return


def flood_by_credits(port: int, cookie: str, over: Event) -> None:
    """Ask for pictures without end."""
    flood_by_websocket(port, cookie, over, CREDIT)


def flood_by_hands(port: int, cookie: str, over: Event) -> None:
    """Move the hand without end."""
    flood_by_websocket(port, cookie, over, HAND)


def flood_by_pings(port: int, cookie: str, over: Event) -> None:
    """Ping without end."""
    flood_by_websocket(port, cookie, over, b"")


def flood_by_strangers(port: int, _: str, over: Event) -> None:
    """Ask without the token, each time by a new connection."""
    request = f"GET /surface HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode()
    while not over.is_set():
        with socket.create_connection(("127.0.0.1", port), timeout=2) as line:
            line.sendall(request)
            line.recv(1 << 16)


def open_halfway(port: int, _: str, over: Event) -> None:
    """Open connections that send half of a request's headers."""
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2 * HALF_OPEN, most), most))
    lines = []
    for _ in range(HALF_OPEN):
        with contextlib.suppress(OSError):
            lines.append(socket.create_connection(("127.0.0.1", port), timeout=2))
            lines[-1].sendall(b"GET / HTTP/1.1\r\n")
    over.wait()


FLOODS: tuple[tuple[str, int, Callable[[int, str, Event], None]], ...] = (
    ("a page that floods with credits", 1, flood_by_credits),
    ("a page that floods with hands", 1, flood_by_hands),
    ("a program that pings without end", 1, flood_by_pings),
    ("eight pages that flood with credits", 8, flood_by_credits),
    ("a stranger's program that asks without end", 1, flood_by_strangers),
    (f"{HALF_OPEN} half-open connections", 1, open_halfway),
)


def pictures_per_second(page: ClientConnection, seconds: float) -> float:
    """Ask for pictures at the pace of a display, and count those that come."""
    count, begun = 0, time.perf_counter()
    while (at := time.perf_counter()) < begun + seconds:
        page.send(HAND)
        page.send(CREDIT)
        with contextlib.suppress(TimeoutError):
            page.recv(timeout=begun + seconds - at)
            count += 1
        time.sleep(max(0.0, at + 1.0 / WANTED - time.perf_counter()))
    return count / (time.perf_counter() - begun)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3.0, help="of each measurement")
    seconds = min(parser.parse_args().seconds, LONGEST)
    context = multiprocessing.get_context("spawn")
    with Viewer(touch_model("nylon", quick=True), port=0) as viewer:
        cookie = "; ".join(f"{name}={value}" for name, value in viewer.cookies.items())
        address = viewer.address.replace("http", "ws", 1) + "touch"
        headers = {"Cookie": cookie}
        with connect(address, origin=viewer.address.rstrip("/"), additional_headers=headers) as page:
            page.recv(timeout=5)
            print(f"| nothing | {pictures_per_second(page, seconds):.0f} |", flush=True)
            for name, count, flood in FLOODS:
                over = context.Event()
                processes = [
                    context.Process(target=flood, args=(viewer.port, cookie, over), daemon=True)
                    for _ in range(count)
                ]
                for process in processes:
                    process.start()
                time.sleep(4.0)  # they import first
                rate, begun = pictures_per_second(page, seconds), time.perf_counter()
                status = httpx.get(viewer.address, cookies=viewer.cookies, timeout=10).status_code
                opened = (
                    f"opens in {time.perf_counter() - begun:.2f} s" if status == 200 else f"answers {status}"
                )
                print(f"| {name} | {rate:.0f}; the page {opened} |", flush=True)
                over.set()
                for process in processes:
                    process.join(5)
                    process.kill()


if __name__ == "__main__":
    main()
