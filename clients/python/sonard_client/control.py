"""HTTP control of a running sonard (docs/control.md): status, settings, water, scene, objects, events."""
from __future__ import annotations

import errno
import http.client
import json
import socket
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Union
from urllib.parse import quote, urlencode

from .faults import Fault
from .pose_messages import FRAMES
from .rotations import orientation, three

Json = Dict[str, Any]

_FIRST_REPLY_S = 2.0  # sonard replies to /healthz at once; a longer silence means a different server

# 64-bit fields of control.proto's answers: strings in protobuf's JSON mapping, converted to int here. A test
# checks that the list has all of them.
_WIDE = {"seed", "pings", "refused", "served", "dropped", "skipped_ticks", "clients", "refused_clients", "pings_written",
         "pings_dropped", "bytes_written", "bytes_read", "accepted", "late", "replaced", "over_rate", "fired_at_ns", "now_ns", "unsent", "messages", "bytes",
         "seq", "utc_ns", "mono_ns", "time_ns", "client_number", "offset", "bytes_before", "bytes_after", "injections",
         "distances_sent", "distances_dropped"}
_LATEST = 2 ** 64 - 1


class ControlError(Exception):
    """A reply other than OK: HTTP `status`, `code` (REFUSED, UNSUPPORTED, FAILED) and message `text`."""

    def __init__(self, status: int, code: str, text: str) -> None:
        super().__init__(text or f"HTTP status {status}")
        self.status, self.code, self.text = status, code, text


class Events(Iterator[Json]):
    """for event in control.events(pings=True): ...   It is also a context manager. close() ends the subscription."""

    def __init__(self, connection: http.client.HTTPConnection, reply: http.client.HTTPResponse,
                 sock: Optional[socket.socket], timeout: Optional[float]) -> None:
        self._connection, self._reply, self._socket, self._timeout = connection, reply, sock, timeout

    def __next__(self) -> Json:
        try:
            line = self._reply.readline()
        except socket.timeout:
            self.close()
            raise TimeoutError(f"no event within {self._timeout:g} s") from None
        except (http.client.HTTPException, ConnectionError):  # lost within a chunk
            line = b""
        if not line:
            self.close()
            raise StopIteration
        return dict(_read_json(line))

    def interrupt(self) -> None:
        """Ends the iteration. May be called from another thread."""
        try:
            if self._socket is not None:
                self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # the connection has ended

    def close(self) -> None:
        self._reply.close()
        self._connection.close()

    def __enter__(self) -> Events:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


class Control:
    """Control("127.0.0.1").set_sonar("front", range_m=5)

    Each call opens its own connection. Raises OSError if the port is closed or is not sonard's HTTP port, and
    ControlError if the reply is not OK. Settings that are None keep their values."""

    def __init__(self, host: str = "127.0.0.1", port: int = 8088, token: Optional[str] = None, timeout: float = 30.0) -> None:
        self.host, self.port, self.timeout = host, port, timeout
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._checked = False

    # ---- state
    def status(self) -> Json:
        """Returns the DaemonStatus of control.proto: sonars with clients and figures, vehicles, objects, poses, environment."""
        return dict(_read_json(self._get("/api/v1/status")))

    def health(self) -> str:
        """Returns "ok", or the error that sonard reports."""
        status, text = self._request("GET", "/healthz")
        if status not in (200, 503):
            raise _error(status, text)
        return text.strip()

    def metrics(self) -> Dict[str, float]:
        """Returns all metrics by Prometheus name and labels: 'sonard_pings_total{sonar="front"}'."""
        lines = self._get("/metrics").splitlines()
        pairs = (line.rsplit(" ", 1) for line in lines if line and not line.startswith("#"))
        return {name: float(value) for name, value in pairs}

    def events(self, pings: bool = False, clients: bool = False, poses: bool = False, scene: bool = False,
               faults: bool = False, timeout: Optional[float] = None) -> Events:
        """Subscribes to events of the given kinds, or of all kinds; each event has one of the keys ping, client, pose, scene, fault.
        The iteration ends when the daemon stops. Raises TimeoutError after `timeout` seconds without an event; None waits
        without limit."""
        wanted = {"pings": pings, "clients": clients, "poses": poses, "scene": scene, "faults": faults}
        query = urlencode({kind: 1 for kind, yes in wanted.items() if yes})
        self._check_server()
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            connection.request("GET", "/api/v1/events" + ("?" + query if query else ""), headers=self._headers)
            sock = connection.sock  # getresponse() may move it to the reply and set this to None
            reply = connection.getresponse()
            if reply.status != 200:
                raise _error(reply.status, reply.read().decode(errors="replace"))
        except BaseException:
            connection.close()
            raise
        return Events(connection, reply, sock, timeout)

    # ---- sonars and water
    def set_sonar(self, sonar: str = "", range_m: Optional[float] = None, rate_hz: Optional[float] = None,
                  gain_percent: Optional[float] = None, mode: Optional[int] = None, beams: Optional[int] = None,
                  transmit: Optional[bool] = None) -> None:
        """Changes settings like another client of the sonar. rate_hz: 0 = standby. mode: from 0, the lowest frequency first.
        transmit False: noise only. The name is optional if there is one sonar."""
        self._post("sonar", _given(sonar=sonar or None, range_m=range_m, rate_hz=rate_hz, gain_percent=gain_percent, mode=mode,
                                   beams=beams, transmit=transmit))

    def mount_sonar(self, sonar: str = "", position: Optional[Sequence[float]] = None, rpy_deg: Optional[Sequence[float]] = None,
                    frame: str = "FLU") -> None:
        """Sets the mount of the sonar on its vehicle, as a tilt unit does: its position, its angles or both. A value that is None keeps
        the present one. frame: "FLU" or "FRD"; position: m; rpy_deg: intrinsic Z-Y-X."""
        if position is None and rpy_deg is None:
            raise ValueError("a mount needs a position, angles (rpy_deg) or both")
        given = _given(position=None if position is None else _xyz("position", position),
                       rpy_deg=None if rpy_deg is None else _xyz("rpy_deg", rpy_deg))
        self._post("sonar", _given(sonar=sonar or None, mount=dict(given, frame=frame)))

    def set_environment(self, temperature_c: Optional[float] = None, salinity_psu: Optional[float] = None,
                        ph: Optional[float] = None, sound_speed_mps: Optional[float] = None) -> None:
        """Sets properties of the water. sound_speed_mps: 0 = computed from the others."""
        given = _given(temperature_c=temperature_c, salinity_psu=salinity_psu, ph=ph, sound_speed_mps=sound_speed_mps)
        self._post("environment", {"environment": given})

    # ---- the scene; the reply comes when the change applies to the next ping
    def load_scene(self, path: str, timeout: float = 330.0) -> None:
        """Loads a scene, named as in world.scene."""
        self._post("load", {"path": path}, timeout)

    def add_object(self, name: str, like: str, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                   rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU", material: str = "",
                   moving: bool = False) -> None:
        """Adds a copy of the object `like`. moving: it accepts move_object()."""
        at = _placement(position, quaternion, rpy, frame)
        self._post("add_object", _given(name=name, like=like, material=material or None, at=at, moving=moving))

    def remove_object(self, name: str) -> None:
        self._post("remove_object", {"object": name})

    def show_object(self, name: str) -> None:
        self._post("set_object", {"object": name, "visible": True})

    def hide_object(self, name: str) -> None:
        self._post("set_object", {"object": name, "visible": False})

    def place_object(self, name: str, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                     rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU") -> None:
        """Places a static object elsewhere, which rebuilds the scene. For moving objects use move_object()."""
        self._post("set_object", {"object": name, "at": _placement(position, quaternion, rpy, frame)})

    def move_object(self, name: str, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                    rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU") -> None:
        """Sends a pose of a moving object; it applies from the next ping on."""
        self._post("object", dict(_placement(position, quaternion, rpy, frame), object=name))

    def send_pose(self, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                  rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU", vehicle: str = "",
                  timestamp: Optional[float] = None, timeout: float = 330.0) -> None:
        """Sends a vehicle's pose with acknowledgement; for high rates use PoseSender. timestamp: seconds of the sender's clock.
        With `clock: follow` the reply comes when all pings that the pose made possible are sent."""
        stamp = None if timestamp is None else {"domain": "SIM", "ns": str(round(timestamp * 1e9))}
        self._post("pose", dict(_placement(position, quaternion, rpy, frame), **_given(vehicle=vehicle or None, time=stamp)),
                   timeout)

    # ---- trajectories and recordings
    def set_trajectory(self, vehicle: str = "", object_name: str = "", paused: Optional[bool] = None,
                       position_s: Optional[float] = None, speed: Optional[float] = None) -> None:
        """Controls the playback of a trajectory file by a vehicle or a moving object. position_s: seconds from its start. speed:
        trajectory seconds per second of the daemon's clock, 0.001 to 1000."""
        self._post("set_trajectory", _given(vehicle=vehicle or None, object=object_name or None, paused=paused,
                                            position_s=position_s, speed=speed))

    def start_recording(self, file: str, sonar: str = "", labels: bool = False) -> None:
        """Starts a recording inside sonard, in its folder. The extension selects the kind (docs/recording.md).
        labels: also record to which object the echo in each sample belongs (only .mcap). Returns when the file is open."""
        self._post("start_recording", _given(file=file, sonar=sonar or None, labels=labels or None))

    def stop_recording(self, file: str = "") -> None:
        """Stops one recording, or all. Returns when the files are complete."""
        self._post("stop_recording", _given(file=file or None))

    # ---- injected faults, of a daemon that runs with --faults
    def fault(self, what: str, **record: Any) -> Fault:
        """with control.fault("L05", seconds=6) as fault: ...       The arguments are those of add_fault()."""
        return Fault(self, what, record)

    def add_fault(self, what: str, name: str = "", sonar: str = "", client: str = "", at: Optional[Mapping[str, Any]] = None,
                  seconds: Optional[float] = None, pings: Optional[int] = None, count: Optional[int] = None,
                  parameters: Optional[Mapping[str, Any]] = None) -> None:
        """what: code or name of a kind, or name of a trouble (a group of faults). at: {"ping": 200}, {"every": 50, "phase": 3},
        {"time_s": 4.0}, {"probability": 0.01} or {"on": "connect"}; None = now. parameters: {"bytes": 16, "fill": "zero"}."""
        lasts = _given(seconds=seconds, pings=pings, count=count)
        record = _given(name=name or None, sonar=sonar or None, client=client or None, at=at, **{"with": parameters})
        self._post("faults", dict(record, **{"do": what, "for": lasts}))

    def end_fault(self, name: str) -> None:
        """Raises ControlError if no fault of this name is waiting or active."""
        self._request_ok("DELETE", "/api/v1/faults/" + quote(name, safe=""))

    def reset_faults(self) -> None:
        """Ends all faults."""
        self._post("faults/reset", {})

    def faults(self) -> List[Json]:
        """Returns the faults, each with name, do, code, sonar, state ("waiting", "active", "over"), injections and expires_s."""
        return list(_read_json(self._get(f"/api/v1/faults?after={_LATEST}"))["faults"])

    def fault_kinds(self) -> Json:
        """Returns the catalogue: {"kinds": [...], "troubles": [...]}."""
        report = _read_json(self._get(f"/api/v1/faults/kinds?after={_LATEST}"))
        return {"kinds": report["kinds"], "troubles": report["troubles"]}

    def fault_journal(self, after: int = 0) -> List[Json]:
        """Returns the entries of the journal after the number `after`, at most the latest 1000."""
        return list(_read_json(self._get(f"/api/v1/faults/journal?after={after}"))["journal"])

    # ---- time
    def step(self, dt_s: float, timeout: float = 330.0) -> Json:
        """With clock: lockstep, advances the daemon's time by dt_s and waits until every client has received the pings due in it.
        Returns {"now_ns": the daemon's time, "pings": their number}. A ping due exactly at the end belongs to the next step."""
        return dict(_read_json(self._post("step", {"dt_s": dt_s}, timeout)))

    # ---- HTTP
    def _check_server(self) -> None:
        """Checks once that an HTTP server replies: requests may take minutes, so their timeouts cannot detect a wrong port."""
        if self._checked:
            return
        wrong = (": another program listens there, or sonard is suspended; control.http is on port 8088 unless "
                 "configured otherwise, and sonard's banner names it")
        limit_s = min(self.timeout, _FIRST_REPLY_S)
        try:
            self._exchange("GET", "/healthz", None, limit_s)
        except ConnectionRefusedError:
            raise
        except socket.timeout:
            raise TimeoutError(errno.ETIMEDOUT,
                               f"{self.host}:{self.port} does not answer HTTP within {limit_s:g} s{wrong}") from None
        except (http.client.HTTPException, ConnectionError):
            raise ConnectionError(errno.EPROTO, f"{self.host}:{self.port} does not speak HTTP{wrong}") from None
        self._checked = True

    def _request(self, method: str, path: str, body: Optional[bytes] = None,
                 timeout: Optional[float] = None) -> "tuple[int, str]":
        self._check_server()
        return self._exchange(method, path, body, timeout or self.timeout)

    def _exchange(self, method: str, path: str, body: Optional[bytes], timeout: float) -> "tuple[int, str]":
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            headers = dict(self._headers, **({"Content-Type": "application/json"} if body is not None else {}))
            connection.request(method, path, body, headers)
            reply = connection.getresponse()
            return reply.status, reply.read().decode(errors="replace")
        except ConnectionRefusedError:
            raise ConnectionRefusedError(
                errno.ECONNREFUSED,
                f"{self.host}:{self.port} refuses the connection: is sonard running with control.http?") from None
        finally:
            connection.close()

    def _get(self, path: str) -> str:
        return self._request_ok("GET", path)

    def _request_ok(self, method: str, path: str) -> str:
        status, text = self._request(method, path)
        if status != 200:
            raise _error(status, text)
        return text

    def _post(self, operation: str, message: Json, timeout: Optional[float] = None) -> str:
        body = json.dumps(message, allow_nan=False).encode()
        status, text = self._request("POST", "/api/v1/" + quote(operation), body, timeout)
        if status != 200:
            raise _error(status, text)
        return text


def _error(status: int, body: str) -> ControlError:
    try:
        reply = json.loads(body)
        return ControlError(status, str(reply["code"]), str(reply["text"]))
    except (ValueError, KeyError, TypeError):
        return ControlError(status, "", body.strip()[:200])


def _as_number(item: Json) -> Json:
    def number(value: Any) -> Any:
        if isinstance(value, dict):  # a protobuf map, as `dropped`: its keys are not field names
            return {key: number(inner) for key, inner in value.items()}
        return int(value) if isinstance(value, str) else value

    return {name: number(value) if name in _WIDE else value for name, value in item.items()}


def _read_json(text: Union[str, bytes]) -> Any:
    return json.loads(text, object_hook=_as_number)


def _given(**values: Any) -> Json:
    return {name: value for name, value in values.items() if value is not None}


def _xyz(name: str, values: Sequence[float]) -> Json:
    return dict(zip("xyz", three(name, values)))


def _placement(position: Sequence[float], quaternion: Optional[Sequence[float]], rpy: Optional[Sequence[float]],
               frame: str) -> Json:
    if frame not in FRAMES:
        raise ValueError(f'frame is {frame!r}: it must be "ENU_FLU" or "NED_FRD"')
    quaternion_wxyz = dict(zip("wxyz", orientation(quaternion, rpy)))
    return {"frame": frame, "position": _xyz("position", position), "orientation": quaternion_wxyz}
