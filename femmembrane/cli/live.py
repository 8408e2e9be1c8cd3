"""The live explorer: a small server on this machine, which computes the branch anew while somebody moves the sliders of a page.

It is the page of ``explore`` with a few questions asked of it, which Python's own HTTP server answers: there is nothing to install beside
Plotly, and what is drawn is what a saved page shows. Only who has the address, which contains a word made by chance, is answered.
"""

from __future__ import annotations

import json
import secrets
import sys
import threading
from collections import OrderedDict
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from ..errors import InputError, SolveError
from .outcome import DONE, say

if TYPE_CHECKING:
    from ..scene import Scene
    from ..verbs.live import Answer

#: the page is shown to this machine alone unless another address is asked for
LOOPBACK = "127.0.0.1"
#: largest question in bytes, and branches whose shapes may still be asked for
_QUESTION, _KEPT = 100_000, 8


def serve(scene: Scene, *, host: str = LOOPBACK, port: int = 0, units: str = "scaled") -> int:
    """Serve the page of a scene until Ctrl-C."""
    from ..views.explorer import check_explorer

    check_explorer()
    session = Session(scene, units)
    try:
        server = make_server(session, host, port)
    except (OSError, OverflowError) as error:
        raise InputError("--port", port, f"a free port is needed at {host} ({error})") from None
    with server:
        say(f"explore at {address(server)}\nCtrl-C ends it\n")
        sys.stdout.flush()
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            say("\n")
    return DONE


class Session:
    """What the page asks: branches at values, shapes of their states, and files.

    Parameters
    ----------
    scene : Scene
    units : {"scaled", "si"}
    """

    def __init__(self, scene: Scene, units: str = "scaled") -> None:
        from ..quantities import Units
        from ..verbs.live import ELEMENTS, LiveScene

        self.units, self._chosen = units, Units.of(units, scene.converter)
        self.live = LiveScene(scene)
        own = self.live.elements
        self._choices = [] if own is None else sorted({*ELEMENTS, own})
        self._place = None if own is None else self._choices.index(own)
        self._answers: OrderedDict[int, Answer] = OrderedDict()
        self._lock, self._last = threading.Lock(), 0

    def page(self) -> str:
        """The page, with the branch of the scene as it is."""
        from ..quantities import key_label
        from ..views.explorer import live_page

        data = self.branch({"values": {}, "elements": None})
        sliders = [
            {"name": s.name, "label": key_label(s.name), "value": s.value, "low": s.low, "high": s.high} for s in self.live.sliders()
        ]
        data["live"] = {"sliders": sliders, "elements": self._place, "choices": self._choices}
        return live_page(data)

    def branch(self, question: dict[str, Any]) -> dict[str, Any]:
        """The branch at values, without shapes."""
        from ..views.explorer_data import page_data

        with self._lock:
            answer = self.live.answer(question["values"], question["elements"])
            if not len(answer.branch):
                raise SolveError(answer.branch.message, status=answer.branch.status)
            self._last += 1
            self._answers[self._last] = answer
            while len(self._answers) > _KEPT:
                self._answers.popitem(last=False)
            data = page_data(answer.branch, self.units, shapes=False)
            size = getattr(answer.scene.mesh, "elements", None)
            data |= {"version": self._last, "milliseconds": round(answer.milliseconds, 1), "mesh": ""}
            data["error"] = answer.error if answer.error == answer.error else None
            if size is not None:
                data["mesh"] = f"{size} elements of degree {answer.scene.degree}"
        return data

    def shape(self, question: dict[str, Any]) -> dict[str, Any]:
        """The shape of one state of a branch that was answered."""
        from ..views.explorer_data import shape_of, states_of

        with self._lock:
            answer = self._answers.get(question["version"])
            states = [] if answer is None else states_of(answer.branch)
            if not 0 <= int(question["state"]) < len(states):
                raise InputError("state", question["state"], "a state of one of the last branches is allowed")
            return shape_of(states[int(question["state"])].equilibrium, self._chosen)

    def file(self, question: dict[str, Any]) -> dict[str, Any]:
        """The scene at values, its table, or its page, as the text of a file."""
        from ..results.table import write_csv
        from ..views.explorer import explorer

        name = str(question["name"])
        with self._lock, TemporaryDirectory() as folder:
            path = Path(folder) / "file"
            if name == "scene.toml":
                self.live.scene_at(question["values"], question["elements"]).to_toml(path)
                return {"text": path.read_text(encoding="utf-8")}
            branch = self.live.answer(question["values"], question["elements"]).branch
            if name == "explore.html":
                return {"text": explorer(branch, self.units)}
            if name == "branch.csv":
                write_csv(branch, path)
                return {"text": path.read_text(encoding="utf-8")}
        raise InputError("name", name, "scene.toml, branch.csv and explore.html are allowed")


def make_server(session: Session, host: str = LOOPBACK, port: int = 0) -> ThreadingHTTPServer:
    """A server that answers the questions of a page, under an address that nobody can guess."""
    server = _Server((host, port), _Handler)
    server.daemon_threads = True
    server.session, server.word = session, secrets.token_urlsafe(16)  # type: ignore[attr-defined]
    return server


def address(server: ThreadingHTTPServer) -> str:
    """Where the page is."""
    return f"http://{_place(server)}/{server.word}/"  # type: ignore[attr-defined]


def _place(server: Any) -> str:
    host, port = server.server_address[:2]
    return f"{host}:{port}"


class _Server(ThreadingHTTPServer):
    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that is closed does not wait for its answer: nothing is wrong."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """GET answers the page, POST the questions of it. Any other address, and any other name of this machine, does not exist."""

    server_version, sys_version, protocol_version = "femmembrane", "", "HTTP/1.1"

    def do_GET(self) -> None:
        if self._asked() != "":
            self._answer(404, {"message": "there is nothing here"})
            return
        try:
            self._send(200, self.server.session.page().encode("utf-8"), "text/html; charset=utf-8")  # type: ignore[attr-defined]
        except (InputError, SolveError) as error:
            self._answer(400, {"message": str(error)})

    def do_POST(self) -> None:
        asked, length = self._asked(), self.headers.get("Content-Length", "")
        if asked not in ("branch", "shape", "file") or not length.isdigit() or int(length) > _QUESTION:
            self.close_connection = True
            self._answer(404, {"message": "there is nothing here"})
            return
        try:
            question = json.loads(self.rfile.read(int(length)))
            self._answer(200, getattr(self.server.session, asked)(question))  # type: ignore[attr-defined]
        except (InputError, SolveError) as error:
            self._answer(400, {"message": str(error)})
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            self._answer(400, {"message": f"the question is not understood ({error})"})

    def _asked(self) -> str | None:
        """What is asked below the word of the server; None for another address, or where a page of another host asks."""
        place = _place(self.server)
        own = {place, "localhost:" + place.rpartition(":")[2]}
        start = f"/{self.server.word}/"  # type: ignore[attr-defined]
        if self.headers.get("Host") not in own or not self.path.startswith(start):
            return None
        return self.path.removeprefix(start)

    def _answer(self, code: int, found: dict[str, Any]) -> None:
        self._send(code, json.dumps(found, separators=(",", ":")).encode("utf-8"), "application/json")

    def _send(self, code: int, body: bytes, kind: str) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: the page says what goes wrong."""
