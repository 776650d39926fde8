"""Asks and steers a running sonard over HTTP, docs/control.md: status, settings, water, scene, objects, events."""
from __future__ import annotations

import errno
import http.client
import json
import socket
from typing import Any, Dict, Iterator, Optional, Sequence, Union
from urllib.parse import quote, urlencode

from .pose_messages import FRAMES
from .rotations import orientation, three

Json = Dict[str, Any]

_FIRST_ANSWER_S = 2.0  # a sonard says at once how it is, whatever it is doing: what is silent for longer is something else

# 64 bits wide in control.proto, and therefore strings in its JSON; numbers here.
_WIDE = {"seed", "pings", "refused", "served", "dropped", "skipped_ticks", "clients", "refused_clients", "pings_written",
         "pings_dropped", "bytes_written", "accepted", "late", "replaced", "over_rate", "fired_at_ns", "now_ns", "unsent", "messages", "bytes"}


class ControlError(Exception):
    """What sonard answered instead of OK: `status` of HTTP, `code` (REFUSED, UNSUPPORTED, FAILED) and its sentence."""

    def __init__(self, status: int, code: str, text: str) -> None:
        super().__init__(text or f"HTTP status {status}")
        self.status, self.code, self.text = status, code, text


class Events(Iterator[Json]):
    """for event in control.events(pings=True): ...   Also a context manager; close() ends the subscription."""

    def __init__(self, connection: http.client.HTTPConnection, answer: http.client.HTTPResponse,
                 timeout: Optional[float]) -> None:
        self._connection, self._answer, self._timeout = connection, answer, timeout

    def __next__(self) -> Json:
        try:
            line = self._answer.readline()
        except socket.timeout:
            self.close()
            raise TimeoutError(f"no event within {self._timeout:g} s") from None
        except http.client.HTTPException:  # cut off within a chunk
            line = b""
        if not line:
            self.close()
            raise StopIteration
        return dict(_read_json(line))

    def close(self) -> None:
        self._answer.close()
        self._connection.close()

    def __enter__(self) -> Events:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


class Control:
    """Control("127.0.0.1").set_sonar("front", range_m=5)

    Each call is a connection of its own. OSError when nobody listens there, or something else than sonard's HTTP;
    ControlError when the answer is not OK. What is None stays as it is."""

    def __init__(self, host: str = "127.0.0.1", port: int = 8088, token: Optional[str] = None, timeout: float = 30.0) -> None:
        self.host, self.port, self.timeout = host, port, timeout
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._met = False

    # ---- asking
    def status(self) -> Json:
        """The DaemonStatus of control.proto: sonars with clients and figures, vehicles, objects, poses, environment."""
        return dict(_read_json(self._get("/api/v1/status")))

    def health(self) -> str:
        """"ok", or what is wrong."""
        status, text = self._ask("GET", "/healthz")
        if status not in (200, 503):
            raise _error(status, text)
        return text.strip()

    def metrics(self) -> Dict[str, float]:
        """All figures, by name and labels as Prometheus has them: 'sonard_pings_total{sonar="front"}'."""
        lines = self._get("/metrics").splitlines()
        pairs = (line.rsplit(" ", 1) for line in lines if line and not line.startswith("#"))
        return {name: float(value) for name, value in pairs}

    def events(self, pings: bool = False, clients: bool = False, poses: bool = False, scene: bool = False,
               timeout: Optional[float] = None) -> Events:
        """Events from now on as they happen, those of the kinds named, or of all kinds; each has one of the keys ping, client,
        pose, scene. It ends when the daemon does. TimeoutError when none comes for `timeout` seconds; None waits for ever."""
        wanted = {"pings": pings, "clients": clients, "poses": poses, "scene": scene}
        query = urlencode({kind: 1 for kind, yes in wanted.items() if yes})
        self._meet()
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            connection.request("GET", "/api/v1/events" + ("?" + query if query else ""), headers=self._headers)
            answer = connection.getresponse()
            if answer.status != 200:
                raise _error(answer.status, answer.read().decode(errors="replace"))
        except BaseException:
            connection.close()
            raise
        return Events(connection, answer, timeout)

    # ---- sonars and water
    def set_sonar(self, sonar: str = "", range_m: Optional[float] = None, rate_hz: Optional[float] = None,
                  gain_percent: Optional[float] = None, mode: Optional[int] = None, beams: Optional[int] = None,
                  transmit: Optional[bool] = None) -> None:
        """As if by one more client of the sonar. rate_hz: 0 = standby. mode: from 0, the lowest frequency first. transmit False:
        it hears noise only. The name may be left out when there is one sonar."""
        self._post("sonar", _given(sonar=sonar or None, range_m=range_m, rate_hz=rate_hz, gain_percent=gain_percent, mode=mode,
                                   beams=beams, transmit=transmit))

    def mount_sonar(self, sonar: str = "", position: Sequence[float] = (0, 0, 0), rpy_deg: Sequence[float] = (0, 0, 0),
                    frame: str = "FLU") -> None:
        """Where the sonar sits on its vehicle: a tilt head. frame: "FLU" or "FRD"; rpy_deg: intrinsic Z-Y-X."""
        mount = {"frame": frame, "position": _xyz("position", position), "rpy_deg": _xyz("rpy_deg", rpy_deg)}
        self._post("sonar", _given(sonar=sonar or None, mount=mount))

    def set_environment(self, temperature_c: Optional[float] = None, salinity_psu: Optional[float] = None,
                        ph: Optional[float] = None, sound_speed_mps: Optional[float] = None) -> None:
        """The water. sound_speed_mps: 0 = computed from the rest."""
        given = _given(temperature_c=temperature_c, salinity_psu=salinity_psu, ph=ph, sound_speed_mps=sound_speed_mps)
        self._post("environment", {"environment": given})

    # ---- the scene; answered when the next ping sees it
    def load_scene(self, path: str, timeout: float = 330.0) -> None:
        """Named as in world.scene."""
        self._post("load", {"path": path}, timeout)

    def add_object(self, name: str, like: str, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                   rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU", material: str = "",
                   moving: bool = False) -> None:
        """A copy of the object `like`. moving: it takes move_object()."""
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
        """Puts an object elsewhere for good: the scene is made anew for it. Moving ones take move_object()."""
        self._post("set_object", {"object": name, "at": _placement(position, quaternion, rpy, frame)})

    def move_object(self, name: str, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                    rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU") -> None:
        """A pose for a moving object; it counts from the next ping on."""
        self._post("object", dict(_placement(position, quaternion, rpy, frame), object=name))

    def send_pose(self, position: Sequence[float], quaternion: Optional[Sequence[float]] = None,
                  rpy: Optional[Sequence[float]] = None, frame: str = "ENU_FLU", vehicle: str = "",
                  timestamp: Optional[float] = None, timeout: float = 330.0) -> None:
        """A vehicle's pose, and an answer to it; many a second are PoseSender's. timestamp: seconds on the sender's own clock.
        With clock: follow the answer comes when every ping is out that the pose made possible."""
        stamp = None if timestamp is None else {"domain": "SIM", "ns": str(round(timestamp * 1e9))}
        self._post("pose", dict(_placement(position, quaternion, rpy, frame), **_given(vehicle=vehicle or None, time=stamp)),
                   timeout)

    # ---- trajectories and recordings
    def set_trajectory(self, vehicle: str = "", object_name: str = "", paused: Optional[bool] = None,
                       position_s: Optional[float] = None, speed: Optional[float] = None) -> None:
        """Of what a vehicle, or the moving object named, plays from a file. position_s: seconds from its start. speed: seconds of
        it for one of the daemon's clock, 0.001 to 1000."""
        self._post("set_trajectory", _given(vehicle=vehicle or None, object=object_name or None, paused=paused,
                                            position_s=position_s, speed=speed))

    def start_recording(self, file: str, sonar: str = "") -> None:
        """sonard writes it, in the folder of its configuration; the end of the name says the kind: .mcap, .pcap, .oculus, .raw.
        Returns when the file is open."""
        self._post("start_recording", _given(file=file, sonar=sonar or None))

    def stop_recording(self, file: str = "") -> None:
        """One, or all. Returns when the file is complete."""
        self._post("stop_recording", _given(file=file or None))

    # ---- time
    def step(self, dt_s: float, timeout: float = 330.0) -> Json:
        """With clock: lockstep, lets the daemon's time pass by dt_s; returns when every ping due in it is out: {"now_ns": the
        daemon's time then, "pings": made meanwhile}. A ping due at the very end belongs to the next step."""
        return dict(_read_json(self._post("step", {"dt_s": dt_s}, timeout)))

    # ---- HTTP
    def _meet(self) -> None:
        """Once: does something there speak HTTP? Requests may take minutes, so that their own limits do not tell."""
        if self._met:
            return
        wrong = (": something else listens there, or a sonard that is stopped; control.http is on port 8088 if the configuration "
                 "says nothing else, and sonard's banner names it")
        patience = min(self.timeout, _FIRST_ANSWER_S)
        try:
            self._exchange("GET", "/healthz", None, patience)
        except ConnectionRefusedError:
            raise
        except socket.timeout:
            raise TimeoutError(errno.ETIMEDOUT, f"{self.host}:{self.port} does not answer HTTP within {patience:g} s{wrong}") from None
        except (http.client.HTTPException, ConnectionError):
            raise ConnectionError(errno.EPROTO, f"{self.host}:{self.port} does not speak HTTP{wrong}") from None
        self._met = True

    def _ask(self, method: str, path: str, body: Optional[bytes] = None, timeout: Optional[float] = None) -> "tuple[int, str]":
        self._meet()
        return self._exchange(method, path, body, timeout or self.timeout)

    def _exchange(self, method: str, path: str, body: Optional[bytes], timeout: float) -> "tuple[int, str]":
        connection = http.client.HTTPConnection(self.host, self.port, timeout=timeout)
        try:
            headers = dict(self._headers, **({"Content-Type": "application/json"} if body is not None else {}))
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.read().decode(errors="replace")
        except ConnectionRefusedError:
            raise ConnectionRefusedError(
                errno.ECONNREFUSED, f"nobody listens at {self.host}:{self.port}: is sonard running, with control.http on?") from None
        finally:
            connection.close()

    def _get(self, path: str) -> str:
        status, text = self._ask("GET", path)
        if status != 200:
            raise _error(status, text)
        return text

    def _post(self, operation: str, message: Json, timeout: Optional[float] = None) -> str:
        body = json.dumps(message, allow_nan=False).encode()
        status, text = self._ask("POST", "/api/v1/" + quote(operation), body, timeout)
        if status != 200:
            raise _error(status, text)
        return text


def _error(status: int, body: str) -> ControlError:
    try:
        answer = json.loads(body)
        return ControlError(status, str(answer["code"]), str(answer["text"]))
    except (ValueError, KeyError, TypeError):
        return ControlError(status, "", body.strip()[:200])


def _as_number(item: Json) -> Json:
    return {name: int(value) if name in _WIDE and isinstance(value, str) else value for name, value in item.items()}


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
    turned = dict(zip("wxyz", orientation(quaternion, rpy)))
    return {"frame": frame, "position": _xyz("position", position), "orientation": turned}
