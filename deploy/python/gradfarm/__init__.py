"""Speaks to a gradfarm coordinator over its HTTP interface.

    from gradfarm import Farm

    farm = Farm()                                   # the one of ./gradfarm-data, or of the environment
    job = farm.submit("scene.json", samples=64)
    job.wait()
    image = job.pixels(0)                           # NumPy, height x width x 3, linear

Nothing but the standard library is needed, and NumPy for pixels. What an operation answers is the JSON of the interface as dictionaries;
/api/v1/openapi.json describes it.
"""

import json
import mimetypes
import os
import ssl
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from pathlib import Path

__all__ = ["Farm", "Job", "Problem"]

ROOT = "/api/v1"

# Every operation that this client uses; a test holds them to the coordinator's own description.
OPERATIONS = {
    "health": ("get", "/health"),
    "jobs": ("get", "/jobs"),
    "submit": ("post", "/jobs"),
    "job": ("get", "/jobs/{job}"),
    "change": ("patch", "/jobs/{job}"),
    "cancel": ("post", "/jobs/{job}/cancel"),
    "pause": ("post", "/jobs/{job}/pause"),
    "resume": ("post", "/jobs/{job}/resume"),
    "retry": ("post", "/jobs/{job}/retry"),
    "events": ("get", "/jobs/{job}/events"),
    "accuracy": ("get", "/jobs/{job}/frames/{frame}/accuracy"),
    "exr": ("get", "/jobs/{job}/frames/{frame}/frame.exr"),
    "png": ("get", "/jobs/{job}/frames/{frame}/frame.png"),
    "pfm": ("get", "/jobs/{job}/frames/{frame}/preview.pfm"),
    "workers": ("get", "/workers"),
    "openapi": ("get", "/openapi.json"),
}


class Problem(Exception):
    """What the coordinator answered instead (RFC 9457). `status` is that of HTTP, `body` the whole problem."""

    def __init__(self, status, body):
        super().__init__(body.get("detail") or body.get("title") or f"the coordinator answered {status}")
        self.status = status
        self.body = body


class Farm:
    """A coordinator.

    Address and token are those of the arguments, else of GRADFARM_SERVER, GRADFARM_TOKEN, GRADFARM_TOKEN_FILE and GRADFARM_DATA, else of
    the coordinator's folder `data`. `ca` is a file with the authority of its certificate; that of the folder is found by itself.
    """

    def __init__(self, server=None, token=None, token_file=None, data=None, ca=None):
        folder = Path(data or os.environ.get("GRADFARM_DATA") or "gradfarm-data")
        address = _address(folder)
        self.server = (server or os.environ.get("GRADFARM_SERVER") or address.get("http") or "http://127.0.0.1:7700").rstrip("/")
        token = token or (None if token_file else os.environ.get("GRADFARM_TOKEN"))
        token_file = token_file or os.environ.get("GRADFARM_TOKEN_FILE")
        # The token of a folder is shown to the coordinator of that folder alone.
        if not token and not token_file and address.get("http", "").rstrip("/") == self.server:
            token_file = folder / "token"
        self._token = token or (Path(token_file).read_text().strip() if token_file else None)
        ca = ca or os.environ.get("GRADFARM_CA") or address.get("authority")
        self._tls = ssl.create_default_context(cafile=ca) if self.server.startswith("https:") else None

    def submit(self, scene, assets=None, **options):
        """Submits a scene, a path; `assets` are further files or folders beside it that it refers to.

        Left out, they are the files that a JSON scene names, and for other formats all that lie beside it. Options are those of the
        interface: samples, technique, reconstruction, size, error, seconds, frame_count, priority, project and so on.
        """
        scene = Path(scene)
        options.setdefault("client_token", str(uuid.uuid4()))
        parts = [(name, None, str(value).lower() if isinstance(value, bool) else str(value)) for name, value in options.items()]
        parts += [("asset", name, path) for name, path in _assets(scene, assets)]
        parts.append(("scene", scene.name, scene))
        body, kind = _form(parts)
        # The token of the submission makes trying again safe: it is the same job.
        for last in (False, False, True):
            try:
                return Job(self, self._json("submit", body=body, kind=kind))
            except (urllib.error.URLError, ConnectionError) as fault:
                if last:
                    raise ConnectionError(f"no coordinator answers at {self.server}: {fault}") from fault
                time.sleep(1)

    def job(self, name):
        """The job of this name."""
        return Job(self, self._json("job", job=name))

    def jobs(self, state=None, search=None):
        """All jobs, newest first, as a generator of dictionaries."""
        cursor = None
        while True:
            page = self._json("jobs", query={"limit": 100, "cursor": cursor, "state": state, "search": search})
            yield from page["jobs"]
            cursor = page.get("next")
            if not cursor:
                return

    def workers(self):
        """The connected workers."""
        return self._json("workers")["workers"]

    def health(self):
        """Whether the coordinator works."""
        return self._json("health")

    def openapi(self):
        """The coordinator's description of its interface."""
        return self._json("openapi")

    def _open(self, operation, query=None, body=None, kind=None, timeout=60, **names):
        method, path = OPERATIONS[operation]
        address = self.server + ROOT + path.format(**{name: urllib.parse.quote(str(value), safe="") for name, value in names.items()})
        query = {name: value for name, value in (query or {}).items() if value is not None}
        if query:
            address += "?" + urllib.parse.urlencode(query)
        request = urllib.request.Request(address, data=body, method=method.upper())
        if kind:
            request.add_header("Content-Type", kind)
        if self._token:
            request.add_header("Authorization", f"Bearer {self._token}")
        try:
            return urllib.request.urlopen(request, timeout=timeout, context=self._tls)
        except urllib.error.HTTPError as fault:
            try:
                told = json.loads(fault.read())
            except ValueError:
                told = {}
            raise Problem(fault.code, told) from None

    def _bytes(self, operation, **how):
        with self._open(operation, **how) as answer:
            return answer.read()

    def _json(self, operation, **how):
        return json.loads(self._bytes(operation, **how))


class Job:
    """A job. `told` is what the coordinator said of it last."""

    def __init__(self, farm, told):
        self._farm = farm
        self.told = told

    @property
    def id(self):
        """Its name for the farm."""
        return self.told["id"]

    @property
    def state(self):
        """queued, running, done, failed or cancelled, as was said last."""
        return self.told["state"]

    @property
    def is_over(self):
        """Whether nothing can change any more."""
        return self.state in ("done", "failed", "cancelled")

    def refresh(self):
        """Asks again."""
        self.told = self._farm._json("job", job=self.id)
        return self

    def wait(self, seconds=None):
        """Waits for its end, so long at most. Raises RuntimeError if it is not done then, or failed."""
        end = None if seconds is None else time.monotonic() + seconds
        while not self.is_over:
            left = 30.0 if end is None else min(30.0, end - time.monotonic())
            if left <= 0:
                raise RuntimeError(f"job {self.id} is still {self.state} after {seconds} s")
            self.told = self._farm._json("job", job=self.id, query={"wait": f"{left:.1f}s"}, timeout=left + 60)
        if self.state != "done":
            raise RuntimeError(f"job {self.id} is {self.state}: {self.told.get('error') or 'no reason was told'}")
        return self

    def events(self, tiles=False):
        """What happens to it, as pairs of name and data, until it is over."""
        with self._farm._open("events", job=self.id, query={"tiles": str(tiles).lower()}, timeout=120) as stream:
            name, data = None, []
            for line in stream:
                line = line.decode().rstrip("\r\n")
                if line.startswith("event:"):
                    name = line[6:].strip()
                elif line.startswith("data:"):
                    data.append(line[5:].strip())
                elif not line and data:
                    yield name, json.loads("\n".join(data))
                    name, data = None, []

    def cancel(self):
        """Calls it off."""
        return self._act("cancel")

    def pause(self):
        """No leases until it is resumed."""
        return self._act("pause")

    def resume(self):
        """Goes on."""
        return self._act("resume")

    def retry(self, frame=None):
        """Tries again what failed, in one frame or in all."""
        return self._act("retry", {} if frame is None else {"frame": frame})

    def set_priority(self, priority):
        """Higher goes first."""
        return self._act("change", {"priority": priority})

    def accuracy(self, frame=0):
        """Error against samples and seconds, and what more accuracy costs."""
        return self._farm._json("accuracy", job=self.id, frame=frame)

    def exr(self, frame=0):
        """The finished image with all layers: the bytes of an OpenEXR file."""
        return self._farm._bytes("exr", job=self.id, frame=frame)

    def png(self, frame=0):
        """The finished image for the eye: the bytes of a PNG file."""
        return self._farm._bytes("png", job=self.id, frame=frame)

    def pixels(self, frame=0, view="reconstructed", most=1 << 20):
        """What there is of a frame so far, as a NumPy array of height x width x 3 linear float32 values, top row first.

        `view` is primal, dx, dy, reconstructed or error. Frames of more than `most` pixels are shown as means of squares of pixels.
        """
        return _pfm(self._farm._bytes("pfm", job=self.id, frame=frame, query={"view": view, "most": most}))

    def _act(self, operation, body=None):
        body = None if body is None else json.dumps(body).encode()
        self.told = self._farm._json(operation, job=self.id, body=body, kind="application/json" if body else None)
        return self

    def __repr__(self):
        return f"Job({self.id!r}, {self.state})"


def _address(folder):
    """Where the coordinator of a folder is, if it says so."""
    try:
        return json.loads((folder / "address.json").read_text())
    except (OSError, ValueError):
        return {}


def _strings(value):
    if isinstance(value, str):
        yield value
    elif isinstance(value, (list, dict)):
        for part in value.values() if isinstance(value, dict) else value:
            yield from _strings(part)


def _assets(scene, assets):
    """Names, relative to the scene, and paths of the files that go with it."""
    folder = scene.parent
    if assets is None:
        if scene.suffix == ".json":
            named = sorted(set(_strings(json.loads(scene.read_text()))))
            paths = [folder / name for name in named if name and len(name) < 1024]
            return [(path.relative_to(folder).as_posix(), path) for path in paths if path.is_file() and folder in path.parents]
        assets = [] if scene.suffix == ".glb" else [folder]
    found = {}
    for path in map(Path, assets):
        files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
        for file in files:
            hidden = any(part.startswith(".") for part in file.relative_to(path if path.is_dir() else path.parent).parts)
            if file != scene and not hidden:
                found[os.path.relpath(file, folder).replace(os.sep, "/")] = file
    return sorted(found.items())


def _form(parts):
    """A form: each part is a name, a file name or None, and a text or a path."""
    border = uuid.uuid4().hex
    body = bytearray()
    for name, file, content in parts:
        place = f'form-data; name="{name}"'
        if file is not None:
            place += '; filename="' + file.replace("\\", "\\\\").replace('"', '\\"') + '"'
        kind = mimetypes.guess_type(file)[0] if file else None
        body += f"--{border}\r\nContent-Disposition: {place}\r\n".encode()
        body += f"Content-Type: {kind or 'application/octet-stream'}\r\n\r\n".encode() if file else b"\r\n"
        body += content.read_bytes() if isinstance(content, Path) else content.encode()
        body += b"\r\n"
    body += f"--{border}--\r\n".encode()
    return bytes(body), f"multipart/form-data; boundary={border}"


def _pfm(data):
    """A portable float map as an array, top row first."""
    import numpy

    kind, size, scale, values = data.split(b"\n", 3)
    channels = {b"PF": 3, b"Pf": 1}[kind]
    width, height = map(int, size.split())
    order = "<f4" if float(scale) < 0 else ">f4"
    return numpy.frombuffer(values, order, width * height * channels).reshape(height, width, channels)[::-1].astype("f4")
